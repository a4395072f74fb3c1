// A swivelling head whose gauge line and tool direction are off, read by a control that believes them right.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/swivelling_head.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

// Errors at the queries of one fit share its noise, which moves them in some three ways.
constexpr std::size_t kWays = 3;

TEST(SwivelError, StatesItsUncertaintyAtEveryQuery) {
  std::mt19937_64 random{1};
  Moments pull;
  for (int trial = 0; trial < 400; ++trial) {
    const Head head = randomHead(random);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto solved = solve(swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    ASSERT_EQ(solved->find("error_at_queries_mm")->columns, 3U);
    addErrors(pull, solved.value(), head);
  }
  expectHonest(pull, kWays * 400);
}

// Across the axis stops of the head add to the noise, along it they do nothing.
TEST(SwivelError, IsAsUncertainAsItSaysAlongAnAxisThatIsReadBetter) {
  std::mt19937_64 random{31};
  Moments along;
  for (int trial = 0; trial < 400; ++trial) {
    const Head head = randomHead(random);
    Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, 0.0005, random);
    for (const char* across : {"x_mm", "z_mm"}) {
      for (double& value : columnNamed(dataset, "readings", across)) value += gauss(random, 0.002);
    }
    dataset.config["sigma_mm"] = std::hypot(0.0005, 0.002);
    dataset.config["sigma_along_mm"] = 0.0005;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->warnings, testing::IsEmpty());
    const auto& errors = *solved->find("error_at_queries_mm");
    const std::size_t at = 3 * 7 + 1;  // -60 degrees, 150 mm, Y
    along.add(errors.values[at] - head.error(-60, 150).y(), errors.sd[at]);
    for (std::size_t k = 1; k < solved->residuals.values.size(); k += 3) {
      EXPECT_LT(std::abs(solved->residuals.values[k]), 5 * 0.0005) << "mm, not scaled to the other sigma";
    }
  }
  expectHonest(along);
  EXPECT_LT(std::abs(along.bias()), 4.0);
}

// A head that swivels about any axis, read with two to six tools at two to eight angles, some readings missing.
struct Judged {
  Moments across;
  Moments along;
};

void judge(Judged& judged, const Result& result, const Head& head) {
  const auto& errors = *result.find("error_at_queries_mm");
  std::size_t at = 0;
  for (const double length : {100.0, 150.0, 200.0}) {
    for (const double b : kQueryAngles) {
      const Vector3d truth = head.error(b, length);
      for (Eigen::Index axis = 0; axis < 3; ++axis, ++at) {
        (head.axis[axis] != 0.0 ? judged.along : judged.across).add(errors.values[at] - truth[axis], errors.sd[at]);
      }
    }
  }
}

TEST(SwivelError, IsAsUncertainAsItSaysAboutAnyAxisAndFromAnyReadings) {
  std::mt19937_64 random{21};
  Judged judged;
  for (std::uint64_t trial = 0; trial < runs(1200); ++trial) {
    Head head = randomHead(random);
    head.axis = Vector3d::Zero();
    head.axis[static_cast<Eigen::Index>(random() % 2)] = random() % 2 == 0 ? 1.0 : -1.0;
    head.skew -= head.axis * head.axis.dot(head.skew);
    std::vector<double> angles{-60, 0, 90};
    while (angles.size() < 3 + random() % 6) angles.push_back(uniform(random, -100, 100));
    std::vector<double> lengths{80, 220};
    while (lengths.size() < 2 + random() % 5) lengths.push_back(uniform(random, 60, 260));
    const double sigma = std::pow(10.0, uniform(random, -4.0, -2.0));
    Dataset dataset = swivelDataset(head, angles, lengths, sigma, random);
    keepRows(tableNamed(dataset, "readings"),
             [&](std::size_t row) { return row < 2 * angles.size() || random() % 4 > 0; });
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    judge(judged, solved.value(), head);
  }
  expectHonest(judged.across, kWays * runs(1200));
  expectHonest(judged.along, kWays * runs(1200));
}

// One angle shows along the axis what may follow sin B or 1 - cos B: as often as not one sd off, not fifty.
TEST(SwivelError, StatesAlongTheAxisWhatOneAngleCannotTell) {
  std::mt19937_64 random{22};
  std::size_t within = 0;
  std::size_t all = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Head head = randomHead(random);
    Dataset dataset = swivelDataset(head, {0, 90}, {100, 200}, 0.0005, random);
    if (trial % 2 == 0) dataset.config.erase("sigma_mm");
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    if (trial % 2 == 0) {
      EXPECT_TRUE(solved->find("error_at_queries_mm")->sd.empty()) << "no more readings than unknowns";
      continue;
    }
    const auto& errors = *solved->find("error_at_queries_mm");
    const std::size_t at = 3 * 7 + 1;  // -60 degrees, 150 mm, along
    const double off = errors.values[at] - head.error(-60, 150).y();
    if (std::abs(off) < errors.sd[at]) ++within;
    ++all;
    EXPECT_LT(errors.sd[3 * 11 + 1], 1e-3) << "where it was read it is known";
  }
  EXPECT_THAT(static_cast<double>(within) / static_cast<double>(all),
              testing::AllOf(testing::Gt(0.5), testing::Lt(0.85)));
}

// What live corrections are made of, against the same head read without noise.
TEST(SwivelError, StatesTheUncertaintyOfWhatTheLiveCorrectionTakes) {
  std::mt19937_64 random{11};
  Moments terms;
  Moments left;
  for (int trial = 0; trial < 300; ++trial) {
    const Head head = randomHead(random);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const std::vector<double> angles{-90, -45, 0, 45, 90};
    Dataset dataset = swivelDataset(head, angles, {100, 200}, sigma, random);
    dataset.config["model"] = std::string{trial % 2 == 0 ? "rigid" : "free"};
    const auto solved = solve(dataset);
    const auto truth = solve(swivelDataset(head, angles, {100, 200}, 0.0, random));
    ASSERT_TRUE(solved.ok() && truth.ok());
    const auto add = [&](Moments& moments, const char* key) {
      const auto& found = *solved->find(key);
      ASSERT_EQ(found.sd.size(), found.values.size());
      for (std::size_t k = 0; k < found.values.size(); ++k) {
        const double off = found.values[k] - truth->find(key)->values[k];
        if (found.sd[k] > 1e-12) {
          moments.add(off, found.sd[k]);
        } else {
          EXPECT_NEAR(off, 0.0, 1e-6) << key << " " << k;
        }
      }
    };
    add(terms, "swivel_terms_mm");
    add(left, "left_by_angle_mm");
  }
  expectHonest(terms, kWays * 300);
  expectHonest(left, kWays * 300);
}

// Without a stated sigma; stating one that gives the errors the same sd changes neither.
TEST(SwivelError, StatesWhatIsLeftByTheNoiseThatItStatesTheErrorsBy) {
  std::mt19937_64 random{14};
  Dataset dataset = swivelDataset(randomHead(random), {-90, 0, 45}, {100, 200}, 1e-3, random);
  dataset.config.erase("sigma_mm");
  const auto free = solve(dataset);
  ASSERT_TRUE(free.ok()) << free.error().reason;
  dataset.config["sigma_mm"] = free->find("error_at_queries_mm")->sd[0] / free->find("error_at_queries_mm")->design[0];
  EXPECT_NEAR(free->find("left_by_angle_mm")->sd[1], solve(dataset)->find("left_by_angle_mm")->sd[1], 1e-9);
}

// Second-order terms of the head itself, a few nm.
TEST(SwivelError, IsExactWithoutNoiseWhateverTheAxis) {
  std::mt19937_64 random{2};
  for (const Vector3d& axis : {Vector3d{0, 1, 0}, Vector3d{1, 0, 0}, Vector3d{0, -1, 0}}) {
    Head head;
    head.axis = axis;
    const auto solved = solve(swivelDataset(head, {0, 45, 90}, {100, 200}, 0.0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_EQ(solved->find("model")->value(), 1.0);
    EXPECT_LT(worst(solved.value(), head), 1e-9);
    head.skew = {2e-5, 1e-5, 2e-5};
    head.skew -= axis * axis.dot(head.skew);
    EXPECT_LT(worst(solve(swivelDataset(head, {0, 45, 90}, {100, 200}, 0.0, random)).value(), head), 1e-5);
  }
}

TEST(SwivelError, NeedsOneAngleInThePlaneAndTwoAlongTheAxis) {
  std::mt19937_64 random{3};
  Head head;
  head.skew = {1e-4, 0, 1e-4};
  const auto one = solve(swivelDataset(head, {0, 90}, {100, 200}, 0.0, random));
  ASSERT_TRUE(one.ok()) << one.error().reason;
  EXPECT_THAT(one->warnings, Contains(HasSubstr("45 degrees")));
  double in_plane = 0.0;
  double along = 0.0;
  std::size_t row = 0;
  for (const double length : {100.0, 150.0, 200.0}) {
    for (const double b : kQueryAngles) {
      const Vector3d truth = head.error(b, length);
      const auto* values = &one->find("error_at_queries_mm")->values[3 * row++];
      in_plane = std::max({in_plane, std::abs(values[0] - truth.x()), std::abs(values[2] - truth.z())});
      along = std::max(along, std::abs(values[1] - truth.y()));
    }
  }
  EXPECT_LT(in_plane, 1e-5);
  EXPECT_GT(along, 1e-3);
  EXPECT_LT(worst(solve(swivelDataset(head, {0, 45, 90}, {100, 200}, 0.0, random)).value(), head), 1e-5);
}

// The head is as it is reported: one stop, read with two tools, is not two angles.
TEST(SwivelError, TakesWhatAControlMeasuredAtOneStopForOneAngle) {
  std::mt19937_64 random{13};
  const Head head;
  Dataset dataset = swivelDataset(head, {0.0000, 90.0003}, {100}, 0.0005, random);
  const Dataset other = swivelDataset(head, {0.0002, 89.9998}, {200}, 0.0005, random);
  for (std::size_t k = 0; k < other.tables[0].columns.size(); ++k) {
    auto& cells = tableNamed(dataset, "readings").columns[k].values;
    const auto& added = other.tables[0].columns[k].values;
    cells.insert(cells.end(), added.begin(), added.end());
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("model")->value(), 1.0);
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("45 degrees")));
  const auto& left = *solved->find("left_by_angle_mm");
  ASSERT_EQ(left.values.size(), 8U) << "two stops";
  EXPECT_NEAR(left.values[0], 0.0001, 1e-9) << "degrees";
  EXPECT_NEAR(left.values[4], 90.00005, 1e-9) << "degrees";
  for (std::size_t axis = 1; axis < 4; ++axis) EXPECT_EQ(left.values[axis], 0.0) << "less itself";
}

// What each angle leaves is told less what zero leaves, of however many digits zero is.
TEST(SwivelError, StatesItsUncertaintyWhereAnglesAreMeasured) {
  std::mt19937_64 random{14};
  Moments errors, left;
  for (int trial = 0; trial < 400; ++trial) {
    const Head head = randomHead(random);
    const double sigma = uniform(random, 3e-4, 3e-3);
    Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 150, 200}, 0.0, random);
    auto& rows = tableNamed(dataset, "readings");
    for (std::size_t row = 0; row < rows.rows(); ++row) {
      double& b = columnNamed(dataset, "readings", "B_deg")[row];
      b += uniform(random, -0.05, 0.05);
      const Vector3d at = head.reported(b, columnNamed(dataset, "readings", "L_mm")[row]);
      columnNamed(dataset, "readings", "x_mm")[row] = at.x() + gauss(random, sigma);
      columnNamed(dataset, "readings", "y_mm")[row] = at.y() + gauss(random, sigma);
      columnNamed(dataset, "readings", "z_mm")[row] = at.z() + gauss(random, sigma);
    }
    dataset.config["model"] = std::string{"rigid"};
    dataset.config["sigma_mm"] = sigma;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    addErrors(errors, solved.value(), head);
    const auto& found = *solved->find("left_by_angle_mm");
    ASSERT_EQ(found.values.size(), 20U) << "five stops";
    for (std::size_t axis = 1; axis < 4; ++axis) EXPECT_EQ(found.values[2 * 4 + axis], 0.0) << "zero less itself";
    for (std::size_t k = 0; k < found.values.size(); ++k) {
      if (found.sd[k] > 1e-12) left.add(found.values[k], found.sd[k]);
    }
  }
  expectHonest(errors, kWays * 400);
  expectHonest(left, kWays * 400);
}

TEST(SwivelError, GivesTheWorkedExampleOfARigidHead) {
  std::mt19937_64 random{4};
  Head head;
  head.gauge = {0.025, 0, 0.010};  // q = (.010, .025) in the order (z, x)
  head.direction = {-1e-4, 0, 2e-4};
  Dataset dataset = swivelDataset(head, {0, 90}, {100, 200}, 0.0, random);
  tableNamed(dataset, "queries") = Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
  for (const auto& [b, length] : {std::pair{90.0, 100.0}, {90.0, 200.0}, {30.0, 150.0}}) {
    tableNamed(dataset, "queries").append({b, length});
  }
  const auto solved = solve(dataset);
  const auto& e = solved->find("error_at_queries_mm")->values;
  const std::vector<double> printed_z{.045, .055, .010358984};
  const std::vector<double> printed_x{-.015, -.045, -.018660254};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(e[3 * k + 2], printed_z[k], 5e-9);
    EXPECT_NEAR(e[3 * k], printed_x[k], 5e-9);
  }
  EXPECT_NEAR(solved->find("gauge_line_mm")->values[0], .010, 1e-9);
  EXPECT_NEAR(solved->find("gauge_line_mm")->values[1], .025, 1e-9);
  EXPECT_NEAR(solved->find("tool_direction_rad")->values[0], 2e-4, 1e-11);
}

TEST(SwivelError, GivesTheWorkedExampleOfTheSineRule) {
  Dataset dataset{
      .method = "swivel-error",
      .config = {{"sigma_mm", 0.001}, {"swivel_axis", std::vector<double>{0, 1, 0}}, {"model", std::string{"sine"}}},
      .tables = {}};
  Table readings =
      Table::withColumns("readings", std::array<std::string_view, 5>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"});
  readings.append({0, 100, 1, 2, 3});
  readings.append({90, 100, 1.0421, 1.9963, 3.0218});
  readings.append({0, 200, 4, 5, 6});
  readings.append({90, 200, 4.0643, 4.9942, 6.0301});
  Table queries = Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
  queries.append({90, 150});
  queries.append({30, 150});
  dataset.tables = {readings, queries};
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const std::vector<double> printed{.0532, -.00475, .02595, .0266, -.002375, .012975};
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(solved->find("error_at_queries_mm")->values[k], printed[k], 1e-12);
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("1 - cos B")));
}

TEST(SwivelError, SineIsWrongBetweenTheAnglesThatRigidIsRightAt) {
  std::mt19937_64 random{5};
  const Head head;
  Dataset dataset = swivelDataset(head, {0, 90}, {100, 200}, 0.0, random);
  dataset.config["model"] = std::string{"sine"};
  EXPECT_GT(worst(solve(dataset).value(), head), 0.01);
}

TEST(SwivelError, RecommendsTheModelThatTheReadingsSupport) {
  std::mt19937_64 random{8};
  Head head;
  for (const char* model : {"sine", "rigid", "free"}) {
    Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, 0.0005, random);
    dataset.config["model"] = std::string{model};
    const auto solved = solve(dataset);
    EXPECT_EQ(solved->find("recommended_model")->value(), 1.0) << model;
    EXPECT_GT(solved->find("rms_sine_mm")->value(), 5.0 * solved->find("rms_rigid_mm")->value());
    EXPECT_NEAR(solved->find("rms_free_mm")->value(), solved->find("rms_rigid_mm")->value(), 0.0003);
    EXPECT_THAT(solved->warnings, Not(Contains(HasSubstr("contradict model"))));
  }
  Dataset sheared = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, 0.0005, random);
  const auto b = columnNamed(sheared, "readings", "B_deg");
  auto& x = columnNamed(sheared, "readings", "x_mm");
  for (std::size_t k = 0; k < x.size(); ++k) x[k] += 0.02 * std::sin(b[k] * kDegree);
  sheared.config["model"] = std::string{"rigid"};
  const auto solved = solve(sheared);
  EXPECT_EQ(solved->find("model")->value(), 1.0) << "what was asked for is what is answered";
  EXPECT_EQ(solved->find("recommended_model")->value(), 2.0);
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("support free")));
}

TEST(SwivelError, GivesUpRigidOnlyWhereTheReadingsContradictIt) {
  std::mt19937_64 random{6};
  int freed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const auto solved = solve(swivelDataset(randomHead(random), {-90, -45, 0, 45, 90}, {100, 200}, 0.001, random));
    if (solved->find("model")->value() == 2.0) ++freed;
  }
  EXPECT_LE(freed, 5) << "a rigid head seldom looks otherwise";
  // A head whose plane is not turned but sheared: x follows sin B alone.
  Head head;
  Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, 0.0005, random);
  const auto b = columnNamed(dataset, "readings", "B_deg");
  auto& x = columnNamed(dataset, "readings", "x_mm");
  for (std::size_t k = 0; k < x.size(); ++k) x[k] += 0.02 * std::sin(b[k] * kDegree);
  const auto solved = solve(dataset);
  EXPECT_EQ(solved->find("model")->value(), 2.0);
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("contradict")));
  EXPECT_NEAR(solved->find("error_at_queries_mm")->values[0], head.error(-90, 100).x() - 0.02, 0.003);
}

// Where the noise is known from few residuals only, they may be small by chance.
TEST(SwivelError, SeldomGivesUpARigidHeadWithoutSigmaEither) {
  std::mt19937_64 random{12};
  for (const std::size_t rows : {7U, 8U, 10U}) {  // 3, 6 and 12 degrees of freedom
    int freed = 0;
    for (std::uint64_t trial = 0; trial < runs(1500); ++trial) {
      const std::vector<double> angles =
          rows < 10 ? std::vector<double>{0, -45, 45, 90} : std::vector<double>{0, -90, -45, 45, 90};
      Dataset dataset = swivelDataset({}, angles, {100, 200}, 0.001, random);
      keepRows(tableNamed(dataset, "readings"), [&](std::size_t row) { return row < rows; });
      dataset.config.erase("sigma_mm");
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      if (solved->find("model")->value() == 2.0) ++freed;
    }
    EXPECT_LE(freed, runsAreComplete() ? 12 : 6) << "4.5 of 1500 by chance, with " << rows << " readings";
  }
}

TEST(SwivelError, RefusesByName) {
  std::mt19937_64 random{7};
  const auto refusal = [&](const std::vector<double>& angles, const std::vector<double>& lengths) {
    return refusalOf(swivelDataset({}, angles, lengths, 0.001, random));
  };
  EXPECT_EQ(refusal({0, 90}, {100}), "length-span-too-small");
  EXPECT_EQ(refusal({0, 90}, {100, 109}), "length-span-too-small");
  EXPECT_EQ(refusal({0, 11}, {100, 200}), "swivel-angle-too-small");
  EXPECT_EQ(refusal({0, 180}, {100, 200}), "swivel-angle-too-small");
  EXPECT_EQ(refusal({90}, {100, 200}), "too-few-readings") << "nothing to compare with";
  Dataset dataset = swivelDataset({}, {0, 90}, {100, 200}, 0.001, random);
  dataset.config["model"] = std::string{"cubic"};
  EXPECT_EQ(refusalOf(dataset), "bad-config");
  dataset.config.erase("model");
  dataset.tables.pop_back();
  EXPECT_EQ(refusalOf(dataset), "missing-table");
}

}  // namespace
}  // namespace probebox::metrology
