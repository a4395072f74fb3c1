#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// 0.35 is the tilt of an axis in degrees or milliradians, and of none in radians.
TEST(Limits, OfDirectionsAndStopsOfAxesAreThoseOfRadians) {
  const auto said = [](const std::string& name, const std::string& key, metrology::Value value) {
    auto dataset = readCase(std::filesystem::path{PROBEBOX_REPORT_CASES} / name).value();
    dataset.config[key] = std::move(value);
    const auto solved = metrology::solve(dataset);
    return solved ? std::string{} : solved.error().name + ": " + solved.error().reason;
  };
  for (const std::string key : {"sigma_C_rad", "sd_C_tilt_rad"}) {
    EXPECT_THAT(said("a-axis-alignment", key, 0.35),
                AllOf(HasSubstr("implausible: config key '" + key + "' is 0.35 rad"), HasSubstr("-0.1"),
                      HasSubstr("0.1 rad"), HasSubstr("config.json")));
  }
  EXPECT_THAT(said("a-axis-alignment", "C_tilt_rad", std::vector<double>{1e-4, 0.35}),
              AllOf(HasSubstr("implausible: "), HasSubstr("'C_tilt_rad', number")));
  EXPECT_EQ(said("a-axis-alignment", "sigma_C_rad", 2e-5), "");
  EXPECT_THAT(said("table-pivot", "sigma_angle_rad", 0.5), HasSubstr("implausible"));
  EXPECT_THAT(said("swivel-error", "sigma_angle_rad", 0.5), HasSubstr("implausible"));
}

}  // namespace
}  // namespace probebox::casefolder
