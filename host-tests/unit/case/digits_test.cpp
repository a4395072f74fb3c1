// Numbers that were written with too few digits.
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "reported_case.hpp"

namespace probebox::casefolder {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

TEST(Digits, CoarserThanTheStatedSigmaAreWarnedOf) {
  const auto rounded = [](const std::string& name, const std::string& table, const std::string& what, double digit) {
    const auto solved =
        metrology::solve(changed(name, table, what, [=](double& value) { value = std::round(value / digit) * digit; }));
    return solved ? solved->warnings : std::vector<std::string>{solved.error().name};
  };
  const auto told = Contains(AllOf(HasSubstr("digits of 0.1 mm"), HasSubstr("sigma_mm")));
  EXPECT_THAT(rounded("spindle-offset-2x2", "readings", "x_mm", 0.1), told);
  EXPECT_THAT(rounded("a-axis-alignment", "readings", "y_mm", 0.1), told);
  EXPECT_THAT(rounded("c-axis-alignment", "readings", "x_mm", 0.1), told);
  EXPECT_THAT(rounded("table-pivot", "readings", "z_mm", 0.1), told);
  EXPECT_THAT(rounded("tool-setter", "readings", "z_mm", 0.1), told);
  EXPECT_THAT(rounded("spindle-offset-2x2", "readings", "x_mm", 0.001), testing::IsEmpty());
  EXPECT_THAT(rounded("c-axis-alignment", "readings", "z_mm", 0.1), testing::IsEmpty()) << "a height is set";
}

// Two readings of one coordinate may end in a coarse place by chance; those of three hardly do.
TEST(Digits, OfFewReadingsAreTakenTogether) {
  auto dataset = changed("tool-setter", "readings", "x_mm", [](double&) {});
  for (auto& column : dataset.tables.front().columns)
    if (column.name != "is_tool")
      for (auto& value : column.values) value = std::round(value * 100.0) / 100.0;
  EXPECT_THAT(metrology::solve(dataset).value().warnings,
              Contains(AllOf(HasSubstr("x_mm"), HasSubstr("y_mm"), HasSubstr("z_mm"), HasSubstr("'readings'"),
                             HasSubstr("0.01 mm"))));
}

// A whole number is no sign of a setting where the answer depends on it.
TEST(Digits, OfWholeNumbersAreCoarseWhereTheyWereMeasured) {
  const auto warned = [](const std::string& name, const std::string& what, double digit = 1) {
    const auto solved = metrology::solve(
        changed(name, "readings", what, [=](double& value) { value = std::round(value / digit) * digit; }));
    return solved ? solved->warnings : std::vector<std::string>{solved.error().name};
  };
  const auto told = Contains(AllOf(HasSubstr("digits of 1 mm"), HasSubstr("sigma_mm")));
  EXPECT_THAT(warned("c-axis-alignment", "y_mm"), told);
  EXPECT_THAT(warned("spindle-offset-2x2", "y_mm"), told);
  EXPECT_THAT(warned("a-axis-alignment", "x_mm"), told);
  EXPECT_THAT(warned("table-pivot", "y_mm"), told);
  EXPECT_THAT(warned("tool-setter", "z_mm"), told);
  EXPECT_THAT(warned("c-axis-alignment", "z_mm"), testing::IsEmpty()) << "a height is set";
  auto pocket = changed("pocket-fit", "points", "y_mm", [](double& value) { value = std::round(value); });
  pocket.config["sigma_mm"] = 0.001;
  EXPECT_THAT(metrology::solve(pocket).value().warnings, testing::Not(told)) << "no value depends on it";
}

TEST(Digits, OfSensorsAreComparedWithTheirOwnSigma) {
  const auto warned = [](const std::string& name, const std::string& table, const std::string& what, double digit,
                         const std::string& key, double sigma) {
    auto dataset = changed(name, table, what, [=](double& value) { value = std::round(value / digit) * digit; });
    dataset.config[key] = sigma;
    const auto solved = metrology::solve(dataset);
    return solved ? solved->warnings : std::vector<std::string>{solved.error().name};
  };
  const auto head = [&](const std::string& table, double digit) {
    return warned("sensor-head-calibration", table, "s3", digit, "sigma_sensor", 0.005);
  };
  EXPECT_THAT(head("moves", 0.1),
              Contains(AllOf(HasSubstr("s3 in"), HasSubstr("'moves'"), HasSubstr("0.1"), HasSubstr("sigma_sensor"))));
  EXPECT_THAT(head("readings", 1), Contains(AllOf(HasSubstr("s3 in"), HasSubstr("'readings'"))));
  EXPECT_THAT(head("moves", 0.001), testing::Not(Contains(HasSubstr("digits of"))));
  EXPECT_THAT(warned("screw-compensation", "cycle", "sensor_um", 1, "sigma_um", 0.05),
              Contains(AllOf(HasSubstr("1 um"), HasSubstr("sigma_um"))));
}

TEST(EdgeDigits, ThatHideMicrometresAreRefused) {
  const auto solved = metrology::solve(
      changed("pre-travel", "edges", "contact_s", [](double& value) { value = std::round(value * 100) / 100; }));
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "coarse-stamps") << solved.error().reason;
}

}  // namespace
}  // namespace probebox::casefolder
