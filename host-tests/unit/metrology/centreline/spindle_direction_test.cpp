// Direction of the spindle axis with tip and shank, and from two balls of one holder (B.7).
#include <array>
#include <gmock/gmock.h>

#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/mill_turn.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kTip = 160.0;
constexpr double kRadii = 12.5 + 5.0;  // ball and shank
struct Touch {
  double length{};
  double spindle{};
  double c{};
  Vector2d side{};
  Vector2d at{};
};

// (B16): from opposite sides, the spindle turned in between; X and Y; at both angles of C. Or all sides at all angles,
// which tells the radius from the run-out.
enum class Sides { as_in_B16, all };
std::vector<Touch> touches(double length, Sides sides = Sides::as_in_B16) {
  std::vector<Touch> all;
  for (const double c : kOpposed) {
    for (const Vector2d& u : {Vector2d{1, 0}, Vector2d{0, 1}}) {
      all.push_back({length, 0.0, c, u, {}});
      all.push_back({length, kPi, c, -u, {}});
      if (sides == Sides::as_in_B16) continue;
      all.push_back({length, kPi, c, u, {}});
      all.push_back({length, 0.0, c, -u, {}});
    }
  }
  return all;
}

// The shank of this machine runs out by its `stylus` at that length, and stays clear of the ball by both radii.
void touch(std::vector<Touch>& all, const Machine& machine, double radii = kRadii) {
  for (auto& one : all) one.at = machine.reading(one.spindle, one.c, one.length).head<2>() + radii * one.side;
}

void blur(std::vector<Touch>& all, double sigma, std::mt19937_64& random) {
  for (auto& one : all) one.at += Vector2d{gauss(random, sigma), gauss(random, sigma)};
}

void addShank(Dataset& dataset, const std::vector<Touch>& all) {
  Table& table = addTable(dataset, "shank", {"A_rad", "C_rad", "x_mm", "y_mm", "tip_length_mm", "ux", "uy"});
  for (const auto& one : all) {
    table.append({one.spindle, one.c, one.at.x(), one.at.y(), one.length, one.side.x(), one.side.y()});
  }
}

Dataset tipAndShank(const std::vector<Row>& tips, const std::vector<Touch>& shank, double sigma) {
  Dataset dataset = ballDataset("a-axis-alignment", "tip_length_mm", tips, sigma);
  addShank(dataset, shank);
  return dataset;
}

void readTips(std::vector<Row>& tips, const Machine& machine) {
  for (auto& tip : tips) tip.at = machine.reading(tip.spindle, tip.c, tip.lever).head<2>();
}

TEST(ShankAsTip, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{31};
  Judgement judgement;
  for (int trial = 0; trial < 400; ++trial) {
    const Machine machine = randomMachine(random, 3e-4);
    const double sigma = uniform(random, 2e-4, 3e-3);
    const double height = kTip - uniform(random, 30, 120), ratio = trial % 4 < 2 ? 1 : uniform(random, 0.5, 2.5);
    auto tips = grid({kTip}, kOpposed, kOpposed);
    const auto sides = trial % 2 == 0 ? Sides::as_in_B16 : Sides::all;
    auto shank = touches(height, sides);
    // Unknowns: C axis (2), spindle's direction (2), ball (2), tip (2), shank's run-out (2), and the radii where they
    // show.
    const auto measured = [&](const VectorXd& p) {
      Machine with_tip = machine;
      with_tip.c_point.head<2>() = p.head<2>();
      with_tip.spindle_tilt = p.segment<2>(2) / 100.0;
      with_tip.ball.head<2>() = p.segment<2>(4);
      Machine with_shank = with_tip;
      with_tip.stylus = p.segment<2>(6);
      with_shank.stylus = p.segment<2>(8);
      readTips(tips, with_tip);
      touch(shank, with_shank, p.size() > 10 ? p[10] : kRadii);
      VectorXd values{static_cast<Eigen::Index>(2 * tips.size() + shank.size())};
      Eigen::Index row = 0;
      for (const auto& tip : tips) values.segment<2>(2 * row++) = tip.at;
      for (row *= 2; const auto& one : shank) values[row++] = one.side.dot(one.at) / ratio;
      return values;
    };
    VectorXd truth{11};
    truth << machine.c_point.head<2>(), 100.0 * machine.spindle_tilt, machine.ball.head<2>(), machine.stylus, 0.03,
        -0.02, kRadii;
    if (sides == Sides::as_in_B16) truth.conservativeResize(10);
    const auto covariance = smallestCovariance(measured, truth, sigma);
    (void)measured(truth);
    blur(tips, sigma, random);
    blur(shank, ratio * sigma, random);
    Dataset dataset = tipAndShank(tips, shank, sigma);
    if (ratio != 1) dataset.config["sigma_shank_mm"] = ratio * sigma;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("A_tilt_rad")->values[k] - machine.spindle_tilt[at], solved->find("A_tilt_rad")->sd[k],
                    std::sqrt(covariance(at + 2, at + 2)) / 100.0);
    }
  }
  expectHonest(judgement);
}

// The tip reads the first ball, the shank touches the second one nearer to the spindle, the slide where it was.
struct TwoBalls {
  Machine machine;
  Vector3d offset{4.0, -7.0, -60.0};

  Dataset dataset() const {
    auto tips = grid({kTip}, kOpposed, kOpposed);
    readTips(tips, machine);
    Machine upper = machine;
    upper.ball += offset;
    upper.stylus = {0.03, -0.02};
    auto shank = touches(kTip + offset.z());
    touch(shank, upper);
    Dataset all = tipAndShank(tips, shank, 0.001);
    tableNamed(all, "readings").columns.push_back({"ball", std::vector<double>(tips.size(), 1.0)});
    tableNamed(all, "shank").columns.push_back({"ball", std::vector<double>(shank.size(), 2.0)});
    all.config["ball_offset_mm"] = std::vector<double>{offset.x(), offset.y(), offset.z()};
    all.config["C_tilt_rad"] = std::vector<double>{machine.c_tilt.x(), machine.c_tilt.y()};
    return all;
  }
};

TEST(TwoBallHolder, GivesTheSpindleAgainstZAndAgainstC) {
  std::mt19937_64 random{32};
  for (int trial = 0; trial < 20; ++trial) {
    const TwoBalls holder{.machine = randomMachine(random, 3e-4)};
    const auto solved = solve(holder.dataset());
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->dropped, testing::IsEmpty()) << solved->warnings.front();
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      EXPECT_NEAR(solved->find("A_tilt_rad")->values[k], holder.machine.spindle_tilt[at], 2e-8);
      EXPECT_NEAR(solved->find("A_minus_C_rad")->values[k], holder.machine.spindle_tilt[at] - holder.machine.c_tilt[at],
                  2e-8);
    }
    EXPECT_FALSE(solved->weakest) << "one is the other less a constant";
  }
}

TEST(TwoBallHolder, WeighsWhatIsKnownOfTheHolder) {
  std::mt19937_64 random{33};
  const TwoBalls holder{.machine = randomMachine(random, 3e-4)};
  auto dataset = holder.dataset();
  const double by_readings = solve(dataset)->find("A_tilt_rad")->sd[0];
  dataset.config["sd_C_tilt_rad"] = 2e-5;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  // The balls are as far apart as the lengths: a tilt of C that is wrong goes into the spindle's one to one, and out of
  // the angle between them.
  EXPECT_NEAR(solved->find("A_tilt_rad")->uncertainty[0], std::hypot(by_readings, 2e-5), 1e-8);
  EXPECT_NEAR(solved->find("A_minus_C_rad")->uncertainty[0], by_readings, 1e-8);
}

TEST(SpindleReadings, RefusesByName) {
  const TwoBalls holder;
  const auto refusal = [&](auto&& change) {
    Dataset dataset = holder.dataset();
    change(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("C_tilt_rad"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["C_tilt_rad"] = 1e-4; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "shank", "ball")[1] = 3.0; }), "bad-ball");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "shank", "ux")[0] = 0.5; }), "bad-direction");
  EXPECT_EQ(refusal([](Dataset& d) {
              for (auto& ux : columnNamed(d, "shank", "ux")) ux = std::abs(ux);
            }),
            "not-opposed");
  EXPECT_EQ(refusal([](Dataset& d) {
              std::ranges::fill(columnNamed(d, "shank", "ux"), 0.0);
              auto& uy = columnNamed(d, "shank", "uy");
              for (std::size_t k = 0; k < uy.size(); ++k) uy[k] = k % 2 == 0 ? 1.0 : -1.0;
            }),
            "not-opposed");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("ball_offset_mm"); }), "unknown-column");
}

TEST(CAxisAlignment, TellsTheSlideUnderItsOwnName) {
  std::mt19937_64 random{34};
  const Machine machine = randomMachine(random, 3e-4);
  auto rows = grid({80.0, 180.0}, kOpposed, kOpposed);
  const Vector2d slide{2e-4, -1e-4};  // the chuck stands aside where the slide has carried it
  for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, kTip).head<2>() + slide * row.lever;
  Dataset dataset = ballDataset("c-axis-alignment", "z_mm", rows, 0.001);
  dataset.config["heights"] = std::string{"slide"};
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("C_tilt_rad"), nullptr);
  EXPECT_NEAR(solved->find("Z_slide_rad")->values[0], slide.x(), 1e-9);
  EXPECT_NEAR(solved->find("Z_slide_rad")->values[1], slide.y(), 1e-9);
  dataset.config["heights"] = std::string{"chuck"};
  EXPECT_EQ(refusalOf(dataset), "bad-config");
}

}  // namespace
}  // namespace probebox::metrology
