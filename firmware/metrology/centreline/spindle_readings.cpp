#include "firmware/metrology/centreline/spindle_readings.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/plane_turn.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTwoDirections = 0.1;  // of the opposed sides, least over greatest
constexpr double kSameHeight = 1e-9;    // mm
constexpr std::string_view kTips = "readings";
constexpr std::size_t kMostTools = 64;  // as many as a machine may describe

// The second ball of a holder.
struct SecondBall {
  Vector3d offset{0, 0, 0};  // from the first at C = 0, mm
  Vector2d c_tilt{0, 0};     // displacement of the C axis over a unit of Z
};

Outcome<std::optional<SecondBall>, Refusal> secondBall(const Dataset& dataset) {
  TRY(const auto offset, configVector(dataset, "ball_offset_mm"));
  if (!offset) return std::optional<SecondBall>{};
  TRY(const auto tilt, configPlane(dataset, "C_tilt_rad"));
  SecondBall ball{.offset = Vector3d{offset->data()}};
  if (!tilt && std::abs(ball.offset.z()) > kSameHeight) {
    return Refusal{
        "missing-key",
        "config key 'C_tilt_rad' is missing: the second ball is at another height, so the direction of the C "
        "axis shows in its readings; measure that first (c-axis-alignment) and state its C_tilt_rad"};
  }
  if (tilt) ball.c_tilt = Vector2d{tilt->data()};
  return std::optional{ball};
}

// Takes the place of the second ball out of its readings.
std::optional<Refusal> toFirstBall(BallTable& balls, const Table& table, const SecondBall& second) {
  const auto& which = *table.column("ball");
  for (std::size_t row = 0; row < which.size(); ++row) {
    if (which[row] == 1.0) continue;
    if (which[row] != 2.0) {
      return Refusal{"bad-ball", "table '" + table.name + "', row " + std::to_string(row + 1) + ": ball " +
                                     text(which[row]) + "; number the balls of the holder 1 and 2"};
    }
    auto& reading = balls.readings[row];
    reading.beyond = second.offset.head<2>();
    reading.at -= turn(reading.c) * second.offset.head<2>() + second.c_tilt * second.offset.z();
  }
  return std::nullopt;
}

Outcome<BallTable, Refusal> readTable(const Dataset& dataset, std::string_view name,
                                      std::vector<std::string_view> further, const std::optional<SecondBall>& second) {
  if (second) further.push_back("ball");
  const bool by_tool = name == kTips && dataset.table(name) != nullptr && dataset.table(name)->column(kTool) != nullptr;
  auto balls = readBallTable(dataset, {.table = name,
                                       .lever = kTipLength,
                                       .further = std::move(further),
                                       .parted_by = by_tool ? kTool : std::string_view{}});
  if (!balls || !second) return balls;
  if (auto refusal = toFirstBall(*balls, *dataset.table(name), *second)) return *refusal;
  return balls;
}

// Whether every length was touched from opposite sides, in two directions: only then ball and shank cancel (B16).
std::optional<Refusal> refuseOneSided(const BallTable& shank) {
  for (std::size_t set = 0; set < shank.levers.size(); ++set) {
    Eigen::Matrix2d opposed = Eigen::Matrix2d::Zero();
    for (const auto& a : shank.readings) {
      for (const auto& b : shank.readings) {
        if (a.set != set || b.set != set || a.shank_side->dot(*b.shank_side) > kOppositeCosine) continue;
        opposed += *a.shank_side * a.shank_side->transpose();
      }
    }
    const Eigen::VectorXd spread = symmetricEigenvalues(opposed);
    if (spread[0] > kTwoDirections * spread[1]) continue;
    return Refusal{"not-opposed", "the shank at length " + text(shank.levers[set]) +
                                      " mm did not touch from opposite sides in two directions: touch the ball from +X "
                                      "and -X, +Y and -Y, with the spindle turned by 180 degrees in between"};
  }
  return std::nullopt;
}

std::optional<Refusal> takeSides(BallTable& shank, const Table& table) {
  const auto& ux = *table.column("ux");
  const auto& uy = *table.column("uy");
  for (std::size_t row = 0; row < shank.readings.size(); ++row) {
    const Vector2d side{ux[row], uy[row]};
    if (std::abs(side.norm() - 1.0) > kUnitLength) {
      return Refusal{"bad-direction", "table 'shank', row " + std::to_string(row + 1) +
                                          ": ux, uy must be a unit vector, from the ball to the side that was touched"};
    }
    shank.readings[row].shank_side = side.normalized();
  }
  return refuseOneSided(shank);
}

// numbered: the stops of both tables count as one.
void append(BallTable& tips, BallTable shank, bool numbered) {
  const double stops = numbered ? 0 : 1 + std::ranges::max(tips.readings, {}, &BallReading::stop).stop;
  for (auto& reading : shank.readings) {
    reading.set += tips.levers.size();
    reading.stop += stops;
    tips.readings.push_back(reading);
  }
  tips.levers.insert(tips.levers.end(), shank.levers.begin(), shank.levers.end());
  tips.warnings.insert(tips.warnings.end(), shank.warnings.begin(), shank.warnings.end());
  tips.centreLevers();
}

SpindleReadings withNames(BallTable table, std::size_t tips) {
  SpindleReadings all{.table = std::move(table), .names = {}, .lengths = {}, .spreads = {}, .tip_of_tool = {}};
  for (std::size_t k = 0; k < all.table.readings.size(); ++k) {
    const auto& reading = all.table.readings[k];
    const auto name = k < tips ? "readings " + std::to_string(k + 1) : "shank " + std::to_string(k - tips + 1);
    if (reading.shank_side) {
      all.names.push_back(name);
    } else {
      for (const auto part : kBallParts) all.names.push_back(name + ", " + std::string{part});
    }
    all.lengths.resize(all.names.size(), all.table.levers[reading.set]);
    all.spreads.resize(all.names.size(), reading.spread);
  }
  return all;
}

// A number of a tool.
bool isNumber(double value) {
  return value >= 1 && value < 1e9 && value == std::round(value);
}

std::optional<Refusal> badTool(const Table& table) {
  const auto* tools = table.column(kTool);
  if (tools == nullptr) return std::nullopt;
  const auto bad = std::ranges::find_if_not(*tools, isNumber);
  if (bad == tools->end()) {
    const std::set<double> all{tools->begin(), tools->end()};
    if (all.size() <= kMostTools) return std::nullopt;
    return Refusal{"bad-tool", "table '" + table.name + "' names " + std::to_string(all.size()) +
                                   " tools, each with a result of its own; give a case at most " +
                                   std::to_string(kMostTools)};
  }
  return Refusal{"bad-tool", "table '" + table.name + "', row " + std::to_string(bad - tools->begin() + 1) + ": tool " +
                                 text(*bad) + "; give the number of the tool that carries the tip, from 1 on"};
}

// Row of the tip of each tool; none for a tool that carries several, because none of them is its stylus.
std::map<std::uint32_t, std::size_t> tipOfTool(const Dataset& dataset, const BallTable& tips) {
  const auto* tools = dataset.table(kTips)->column(kTool);
  if (tools == nullptr) return {};
  std::map<std::uint32_t, std::set<std::size_t>> tips_of;
  for (std::size_t row = 0; row < tools->size(); ++row)
    tips_of[static_cast<std::uint32_t>((*tools)[row])].insert(tips.readings[row].set);
  std::map<std::uint32_t, std::size_t> only;
  for (const auto& [tool, sets] : tips_of) {
    if (sets.size() == 1) only.emplace(tool, *sets.begin());
  }
  return only;
}

}  // namespace

std::set<std::uint32_t> toolsOfTips(const Dataset& dataset) {
  const auto* table = dataset.table(kTips);
  const auto* tools = table == nullptr ? nullptr : table->column(kTool);
  if (tools == nullptr) return {};
  std::set<std::uint32_t> numbers;
  for (const double tool : *tools) {
    if (isNumber(tool)) numbers.insert(static_cast<std::uint32_t>(tool));
  }
  return numbers;
}

Outcome<SpindleReadings, Refusal> readSpindleReadings(const Dataset& dataset, double shank_spread) {
  TRY(const auto second, secondBall(dataset));
  TRY(auto tips, readTable(dataset, kTips, {}, second));
  if (auto refusal = badTool(*dataset.table(kTips))) return *refusal;
  auto tip_of_tool = tipOfTool(dataset, tips);
  const std::size_t count = tips.readings.size();
  if (const auto* table = dataset.table("shank")) {
    const bool numbered = dataset.table(kTips)->column(kStop) != nullptr;
    std::vector<std::string_view> further{"ux", "uy"};
    if (numbered) further.push_back(kStop);
    TRY(auto shank, readTable(dataset, "shank", std::move(further), second));
    if (auto refusal = takeSides(shank, *table)) return *refusal;
    for (auto& reading : shank.readings) reading.spread = shank_spread;
    append(tips, std::move(shank), numbered);
  }
  auto all = withNames(std::move(tips), count);
  all.tip_of_tool = std::move(tip_of_tool);
  return all;
}

}  // namespace probebox::metrology
