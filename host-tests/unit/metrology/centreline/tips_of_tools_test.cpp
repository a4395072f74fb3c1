// Offsets of the styli of several tools from the spindle axis, which a-axis-alignment tells beside its direction (B.7,
// (B11)).
#include <algorithm>
#include <map>
#include <string>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/mill_turn.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

struct TipOfTool {
  unsigned tool{};
  double length{};
  Vector2d offset{0, 0};  // from the spindle axis at A = 0
};

struct ReadWith {
  std::size_t tip{};
  double spindle{}, c{};
};

// One row a reading: x and y of the machine, tips as they are.
VectorXd positionsOf(const std::vector<ReadWith>& poses, const std::vector<TipOfTool>& tips, Machine machine) {
  VectorXd values{static_cast<Eigen::Index>(2 * poses.size())};
  for (std::size_t k = 0; k < poses.size(); ++k) {
    machine.stylus = tips[poses[k].tip].offset;
    values.segment<2>(static_cast<Eigen::Index>(2 * k)) =
        machine.reading(poses[k].spindle, poses[k].c, tips[poses[k].tip].length).head<2>();
  }
  return values;
}

Dataset caseOf(const std::vector<ReadWith>& poses, const std::vector<TipOfTool>& tips, const VectorXd& positions,
               double sigma) {
  Dataset dataset{.method = "a-axis-alignment", .config = {{"sigma_mm", sigma}}, .tables = {}};
  Table& table = addTable(dataset, "readings", {"tip_length_mm", "tool", "A_rad", "C_rad", "x_mm", "y_mm"});
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(2 * k);
    const auto& [tip, spindle, c] = poses[k];
    table.append({tips[tip].length, static_cast<double>(tips[tip].tool), spindle, c, positions[at], positions[at + 1]});
  }
  return dataset;
}

std::vector<ReadWith> fourPoses(std::size_t tips, const std::vector<double>& cs = kOpposed) {
  std::vector<ReadWith> poses;
  for (std::size_t tip = 0; tip < tips; ++tip) {
    for (const double c : cs) {
      for (const double spindle : kOpposed) poses.push_back({tip, spindle, c});
    }
  }
  return poses;
}

std::vector<TipOfTool> someTips(std::mt19937_64& random, std::size_t count) {
  std::vector<TipOfTool> tips;
  for (std::size_t k = 0; k < count; ++k) {
    tips.push_back({.tool = static_cast<unsigned>(7 - 2 * k),
                    .length = 100 + 40.0 * static_cast<double>(k) + uniform(random, 0, 20),
                    .offset = {uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1)}});
  }
  return tips;
}

const std::string kOfTool7 = "stylus_offset_of_tool_7_mm", kOfTool5 = "stylus_offset_of_tool_5_mm";

// So its result does not rest on what has the lengths.
TEST(StyliOfTools, AreWhereTheyAreWhateverTheLengthsAre) {
  std::mt19937_64 random{47};
  const auto tips = someTips(random, 2);
  const auto poses = fourPoses(2);
  auto longer = tips;
  longer[0].length += 0.3;
  const VectorXd positions = positionsOf(poses, tips, randomMachine(random, 3e-4));
  const auto as_it_is = solve(caseOf(poses, tips, positions, 1e-3)),
             off = solve(caseOf(poses, longer, positions, 1e-3));
  ASSERT_TRUE(as_it_is && off);
  EXPECT_GT(std::abs(as_it_is->find("A_tilt_rad")->values[0] - off->find("A_tilt_rad")->values[0]), 1e-9);
  for (const auto& key : {kOfTool7, kOfTool5}) {
    for (const std::size_t i : {0U, 1U})
      EXPECT_NEAR(as_it_is->find(key)->values[i], off->find(key)->values[i], 1e-12) << key;
  }
  for (const auto& subject : subjectsOf(caseOf(poses, tips, positions, 1e-3)))
    EXPECT_EQ(subject.independent_of.size(), subject.name == "spindle-tilt" ? 0U : 4U) << subject.name;
}

// Two or three tools, sometimes two of one length; readings missing; C at other angles or still.
TEST(StyliOfTools, ReachTheBoundAndStateTheirUncertainty) {
  std::mt19937_64 random{41};
  Judgement judgement;
  for (int trial = 0; trial < 600; ++trial) {
    const Machine machine = randomMachine(random, 3e-4);
    const double sigma = uniform(random, 2e-4, 3e-3);
    auto tips = someTips(random, trial % 3 == 0 ? 3 : 2);
    if (trial % 6 == 0) tips[2].length = tips[1].length;
    auto poses = fourPoses(tips.size(), trial % 5 == 0 ? std::vector{0.7} : std::vector{0.3, 2.9});
    if (trial % 5 == 1) poses.erase(poses.begin() + 1);
    // Unknowns: C axis, direction of the spindle, ball unless it stands still, and the tips.
    const Eigen::Index first = trial % 5 == 0 ? 4 : 6;
    VectorXd truth{first + static_cast<Eigen::Index>(2 * tips.size())};
    truth.head<4>() << machine.c_point.head<2>(), 100 * machine.spindle_tilt;
    if (first == 6) truth.segment<2>(4) = machine.ball.head<2>();
    for (std::size_t k = 0; k < tips.size(); ++k)
      truth.segment<2>(first + static_cast<Eigen::Index>(2 * k)) = tips[k].offset;
    const auto observe = [&](const VectorXd& p) {
      Machine other = machine;
      auto moved = tips;
      other.c_point.head<2>() = p.head<2>();
      other.spindle_tilt = p.segment<2>(2) / 100;
      if (first == 6) other.ball.head<2>() = p.segment<2>(4);
      for (std::size_t k = 0; k < tips.size(); ++k)
        moved[k].offset = p.segment<2>(first + static_cast<Eigen::Index>(2 * k));
      return positionsOf(poses, moved, other);
    };
    const auto covariance = smallestCovariance(observe, truth, sigma);
    VectorXd measured = observe(truth);
    for (double& value : measured) value += gauss(random, sigma);
    const auto solved = solve(caseOf(poses, tips, measured, sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < tips.size(); ++k) {
      const auto* offset = solved->find("stylus_offset_of_tool_" + std::to_string(tips[k].tool) + "_mm");
      ASSERT_NE(offset, nullptr) << tips[k].tool;
      for (Eigen::Index i = 0; i < 2; ++i) {
        const auto at = first + static_cast<Eigen::Index>(2 * k) + i;
        judgement.add(offset->values[static_cast<std::size_t>(i)] - truth[at], offset->sd[static_cast<std::size_t>(i)],
                      std::sqrt(covariance(at, at)));
      }
    }
  }
  expectHonest(judgement);
}

Dataset plainCase(const std::vector<TipOfTool>& tips, const std::vector<ReadWith>& poses) {
  return caseOf(poses, tips, positionsOf(poses, tips, {}), 0.001);
}

std::vector<std::string> namesOf(const Dataset& dataset) {
  const auto solved = solve(dataset);
  std::vector<std::string> names;
  for (const auto& [name, needs, kept_as, independent_of] : subjectsOf(dataset)) {
    if (needs.empty() || (solved && solved->find(needs) != nullptr)) names.push_back(name);
  }
  return names;
}

using testing::ElementsAre;

TEST(StyliOfTools, AreOneSubjectATool) {
  const std::vector<TipOfTool> tips{{7, 100, {0.02, -0.01}}, {5, 160, {-0.03, 0.04}}};
  const auto dataset = plainCase(tips, fourPoses(2));
  EXPECT_THAT(namesOf(dataset), ElementsAre("spindle-tilt", "stylus-offset-5", "stylus-offset-7"));
  const auto solved = solve(dataset);
  for (const auto& [name, needs, kept_as, independent_of] : subjectsOf(dataset)) {
    if (needs.empty()) continue;
    EXPECT_EQ(independent_of.size(), key::kLengthResults.size());
    const Vector2d truth = name == "stylus-offset-7" ? tips[0].offset : tips[1].offset;
    const auto kept = withKey(*solved, needs, kept_as);
    const auto about = valuesAbout(kept, name);
    ASSERT_EQ(about.size(), 1U) << name;
    EXPECT_EQ(about.front().key, "stylus_offset_mm");
    EXPECT_NEAR(about.front().values[0], truth.x(), 1e-7);
    EXPECT_NEAR(about.front().values[1], truth.y(), 1e-7);
    EXPECT_NEAR(about.front().sd[0], 0.0005, 1e-9);
    EXPECT_EQ(kept.find(needs), nullptr);
    EXPECT_THAT(kept.covariance->components, testing::Contains("stylus_offset_mm[1]"));
    EXPECT_THAT(kept.covariance->components, testing::Not(testing::Contains(needs + "[1]")));
  }
}

TEST(StyliOfTools, AreToldOnlyWhereTheReadingsTellThem) {
  const std::vector<TipOfTool> tips{{7, 100, {0.02, -0.01}}, {5, 160, {-0.03, 0.04}}};
  auto together = fourPoses(2);
  for (auto& pose : together) pose.spindle = pose.c;
  EXPECT_THAT(namesOf(plainCase(tips, together)), ElementsAre("spindle-tilt")) << "only ball less stylus";

  auto nameless = plainCase(tips, fourPoses(2));
  std::erase_if(nameless.tables.front().columns, [](const Column& column) { return column.name == "tool"; });
  EXPECT_THAT(namesOf(nameless), ElementsAre("spindle-tilt")) << "whose tips they are is not said";

  auto two_tips = tips;
  two_tips.push_back({5, 130, {0.01, 0.01}});
  EXPECT_THAT(namesOf(plainCase(two_tips, fourPoses(3))), ElementsAre("spindle-tilt", "stylus-offset-7"))
      << "neither tip of tool 5 is its stylus";
}

TEST(StyliOfTools, AreNotMixedWhereTwoToolsHaveOneLength) {
  const std::vector<TipOfTool> tips{{7, 100, {0.02, -0.01}}, {5, 160, {-0.03, 0.04}}, {3, 160, {0.05, 0.06}}};
  const auto solved = solve(plainCase(tips, fourPoses(3)));
  ASSERT_TRUE(solved.ok());
  EXPECT_NEAR(solved->find(kOfTool5)->values[0], -0.03, 1e-7);
  EXPECT_NEAR(solved->find(kOfTool7)->values[1], -0.01, 1e-7);
  EXPECT_NEAR(solved->find("stylus_offset_of_tool_3_mm")->values[1], 0.06, 1e-7);
  EXPECT_LT(solved->rms, 1e-7) << "one tip for both would leave hundredths of a millimetre";
}

TEST(StyliOfTools, AreThoseOfATipBesideAShank) {
  auto dataset = plainCase({{2, 160, {0.02, -0.01}}}, fourPoses(1));
  Table& shank = addTable(dataset, "shank", {"tip_length_mm", "A_rad", "C_rad", "x_mm", "y_mm", "ux", "uy"});
  Machine machine;
  machine.stylus = {0.3, 0.2};
  for (const Vector2d& u : {Vector2d{1, 0}, Vector2d{-1, 0}, Vector2d{0, 1}, Vector2d{0, -1}}) {
    for (const auto& [tip, spindle, c] : fourPoses(1)) {
      const Vector2d at = machine.reading(spindle, c, 110).head<2>() + 17.5 * u;
      shank.append({110, spindle, c, at.x(), at.y(), u.x(), u.y()});
    }
  }
  EXPECT_THAT(namesOf(dataset), ElementsAre("spindle-tilt", "stylus-offset-2"));
  EXPECT_NEAR(solve(dataset)->find("stylus_offset_of_tool_2_mm")->values[0], 0.02, 1e-7);
  std::erase_if(tableNamed(dataset, "readings").columns, [](const Column& column) { return column.name == "tool"; });
  EXPECT_THAT(namesOf(dataset), ElementsAre("spindle-tilt"));
}

TEST(StyliOfTools, NeedNumbersOfTools) {
  for (const double bad : {0.0, -1.0, 1.5}) {
    auto dataset = plainCase({{7, 100, {0, 0}}, {5, 160, {0, 0}}}, fourPoses(2));
    columnNamed(dataset, "readings", "tool")[3] = bad;
    EXPECT_EQ(refusalOf(dataset), "bad-tool") << bad;
  }
}

TEST(StyliOfTools, AreOfAsManyToolsAsAMachineMayHave) {
  for (const unsigned count : {64U, 65U}) {
    std::vector<TipOfTool> tips;
    for (unsigned tool = 1; tool <= count; ++tool) tips.push_back({tool, 100.0 + tool, {0, 0}});
    const auto solved = solve(plainCase(tips, fourPoses(count)));
    EXPECT_EQ(solved.ok() ? "" : solved.error().name, count == 64 ? "" : "bad-tool");
  }
}

}  // namespace
}  // namespace probebox::metrology
