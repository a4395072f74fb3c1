// What the stops of a swivelling head are off while a setting device is touched: each visit to a B is a stop of its
// own.
#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/setter_cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

const Vector3d kPivot{0, 0, 60};
const Vector3d kProbe{0.021, -0.013, -150}, kTool{0.4, -0.2, -190};  // tips below the gauge line of the level head
const Vector3d kDevice{120, 200, -315};
constexpr double kSigma = 4e-4, kSigmaB_rad = 5e-6;

Vector3d tipAt(const Vector3d& level, double b_rad) {
  return kPivot + AngleAxisd{b_rad, Vector3d::UnitY()} * (level - kPivot);
}

// Three readings with the probe at each B, then three with the tool.
Dataset measured(const std::vector<double>& angles_deg, std::mt19937_64& random) {
  Dataset dataset{.method = "tool-setter", .config = {{"sigma_mm", kSigma}}, .tables = {}};
  stateExactMachine(dataset);
  auto readings =
      Table::withColumns("readings", std::vector<std::string_view>{"is_tool", "x_mm", "y_mm", "z_mm", "B_deg"});
  auto shift = Table::withColumns("readings" + std::string{kHeadStands.suffix},
                                  std::vector<std::string_view>{"x_mm", "y_mm", "z_mm", kOfStop});
  auto offsets = Table::withColumns("probe_offsets", std::vector<std::string_view>{"B_deg", "x_mm", "y_mm", "z_mm"});
  double stop = 0;
  for (const auto& [is_tool, tip] : {std::pair{0.0, kProbe}, {1.0, kTool}}) {
    for (const double b : angles_deg) {
      const double b_rad = b * std::numbers::pi / 180, off_rad = gauss(random, kSigmaB_rad);
      const Vector3d at = kDevice - tipAt(tip, b_rad + off_rad);
      const Vector3d by_one_sd = -kSigmaB_rad * Vector3d::UnitY().cross(tipAt(tip, b_rad) - kPivot);
      ++stop;
      for (int rep = 0; rep < 3; ++rep) {
        readings.append({is_tool, at.x() + gauss(random, kSigma), at.y() + gauss(random, kSigma),
                         at.z() + gauss(random, kSigma), b});
        shift.append({by_one_sd.x(), by_one_sd.y(), by_one_sd.z(), stop});
      }
      const Vector3d offset = tipAt(kProbe, b_rad);
      if (is_tool == 0.0) offsets.append({b, offset.x(), offset.y(), offset.z()});
    }
  }
  dataset.tables = {std::move(readings), std::move(shift), std::move(offsets)};
  return dataset;
}

TEST(StopsOfTheHeadAtASetter, AreInTheSdOfToolAndDeviceAtEveryAngle) {
  std::mt19937_64 random{91};
  const std::vector<double> angles_deg{0, 45, 90};
  Moments tool, device, without;
  for (int trial = 0; trial < 500; ++trial) {
    const Dataset dataset = measured(angles_deg, random);
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved) << solved.error().reason;
    Dataset unaware = dataset;
    std::erase_if(unaware.tables, [](const Table& table) { return table.name.ends_with(kHeadStands.suffix); });
    const auto plain = solve(unaware);
    ASSERT_TRUE(plain) << plain.error().reason;
    const auto &tools = *solved->find("tool_offset_mm"), &devices = *solved->find("setter_mm");
    for (std::size_t k = 0; k < angles_deg.size(); ++k) {
      const Vector3d truth = tipAt(kTool, angles_deg[k] * std::numbers::pi / 180);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        tool.add(tools.values[3 * k + i] - truth[at], tools.sd[3 * k + i]);
        device.add(devices.values[3 * k + i] - kDevice[at], devices.sd[3 * k + i]);
        without.add(tools.values[3 * k + i] - truth[at], plain->find("tool_offset_mm")->sd[3 * k + i]);
      }
    }
  }
  // A stop moves a tip in one direction.
  expectHonest(tool, tool.count / 3);
  expectHonest(device, device.count / 3);
  EXPECT_GT(without.pull(), 5) << "1.6 um of two stops, beside 0.3 um of the readings";
}

// A stop of the probe is in the device and in the tool, one of the tool in the tool alone, and those of another B in
// neither.
TEST(StopsOfTheHeadAtASetter, CorrelateWhatRestsOnOneStop) {
  std::mt19937_64 random{92};
  const auto solved = solve(measured({0, 90}, random));
  ASSERT_TRUE(solved) << solved.error().reason;
  const auto& [names, values] = solved->covariance.value();
  const auto at = [&](const std::string& a, const std::string& b) {
    const auto of = [&](const std::string& name) {
      return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
    };
    EXPECT_LT(of(a), names.size()) << a;
    EXPECT_LT(of(b), names.size()) << b;
    return values.at(of(a) * names.size() + of(b));
  };
  const double of_probe = kSigmaB_rad * 210, of_tool = kSigmaB_rad * 250, of_readings = kSigma * kSigma / 3;
  EXPECT_NEAR(at("tool_offset_mm[0][0]", "tool_offset_mm[0][0]"),
              of_probe * of_probe + of_tool * of_tool + 2 * of_readings, 1e-10);
  EXPECT_NEAR(at("setter_mm[0][0]", "setter_mm[0][0]"), of_probe * of_probe + of_readings, 1e-10);
  EXPECT_NEAR(at("tool_offset_mm[0][0]", "setter_mm[0][0]"), of_probe * of_probe + of_readings, 1e-10);
  EXPECT_NEAR(at("setter_mm[0][0]", "setter_mm[1][2]"), 0, 1e-12) << "another stop";
  const auto line = std::ranges::find(solved->budget, kHeadStands.budget, &Contribution::name);
  ASSERT_NE(line, solved->budget.end());
  EXPECT_NEAR(line->sd[0], std::hypot(of_probe, of_tool), 1e-9);
}

}  // namespace
}  // namespace probebox::metrology
