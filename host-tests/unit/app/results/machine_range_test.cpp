#include "firmware/app/results/machine_range.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <string>
#include <vector>

namespace probebox::app {
namespace {

using metrology::Estimate;
using metrology::Result;
using testing::AllOf;
using testing::HasSubstr;

constexpr MachineTravel kTravel{{{-50, 450}, {-50, 350}, {-400, 50}}};

Result resultOf(std::string method, Estimate estimate) {
  Result result;
  result.method = std::move(method);
  result.estimates = {std::move(estimate)};
  return result;
}

TEST(MachineRange, TakesHomingWithinTheTravelAlone) {
  const auto homed = [](Axis axis, double mm) {
    return validateRange(AxisHomed{.axis = axis, .position_mm = mm, .at = {}}, kTravel);
  };
  EXPECT_FALSE(homed(Axis::x, -50));
  EXPECT_FALSE(homed(Axis::x, 450));
  EXPECT_FALSE(homed(Axis::z, -400));
  EXPECT_FALSE(homed(Axis::x, static_cast<double>(450.0001F))) << "rounding of a float32";
  for (const double mm : {1e6, -50.1, 450.1, std::nan(""), HUGE_VAL}) {
    const auto error = homed(Axis::x, mm);
    ASSERT_TRUE(error) << mm;
    EXPECT_THAT(error->what, AllOf(HasSubstr("axis X"), HasSubstr("-50 mm to 450 mm"), HasSubstr("machine.toml")));
  }
  EXPECT_TRUE(homed(Axis::z, 100)) << "its own travel counts";
  EXPECT_FALSE(validateRange(AxisHomed{.axis = Axis::x, .position_mm = 1e6, .at = {}}, MachineTravel{}))
      << "where none is described";
  EXPECT_TRUE(validateRange(AxisHomed{.axis = Axis::x, .position_mm = std::nan(""), .at = {}}, MachineTravel{}));
}

TEST(MachineRange, TakesNoTurningAxisThatTheMachineCannotHave) {
  const auto centre = [](double x_mm, double y_mm) {
    return validateRange(resultOf("centreline", Estimate::vector("centre_mm", {x_mm, y_mm}, {1e-3, 1e-3})), kTravel);
  };
  EXPECT_FALSE(centre(200, 100));
  EXPECT_FALSE(centre(-500, 100)) << "beside the travel: a chuck whose middle the axis does not reach";
  EXPECT_THAT(centre(-600, 100)->what, AllOf(HasSubstr("centre_mm of X"), HasSubstr("-600 mm"), HasSubstr("travels")));
  EXPECT_THAT(centre(0, 800)->what, HasSubstr("centre_mm of Y"));
  EXPECT_TRUE(centre(1e39, 0));
}

TEST(MachineRange, TakesNoLengthThatNothingOnTheMachineHas) {
  const auto length = [](double mm) {
    return validateRange(resultOf("tool-assembly", Estimate::scalar("assembled_length_mm", mm, 1e-3)), kTravel);
  };
  EXPECT_FALSE(length(200));
  EXPECT_FALSE(length(2900));
  EXPECT_THAT(length(3000)->what, AllOf(HasSubstr("assembled_length_mm"), HasSubstr("2950 mm")));
  EXPECT_TRUE(length(std::nan("")));
  EXPECT_TRUE(length(1e15));
}

// Values beside the answer become places, too: the ball of a check is that of the next one.
TEST(MachineRange, TakesNoLengthBesideTheAnswerThatNothingOnTheMachineHas) {
  const auto ball = [](double z_mm) {
    auto check = resultOf("periodic-check", Estimate::scalar("Xcen_B0_mm", 20, 1e-3));
    check.also = {Estimate::vector("ball_centre_mm", {20, 0, z_mm}, {1e-3, 1e-3, 1e-3})};
    return validateRange(check, kTravel);
  };
  EXPECT_FALSE(ball(-310));
  EXPECT_THAT(ball(-310'000)->what, HasSubstr("ball_centre_mm"));
}

TEST(MachineRange, TakesNoNumberThatIsNone) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(validateRange(resultOf("delay-multi-speed", Estimate::scalar("tau_s", std::nan(""), 1e-6)), kTravel));
  EXPECT_TRUE(validateRange(resultOf("delay-multi-speed", Estimate::scalar("tau_s", 1e-3, inf)), kTravel));
  EXPECT_TRUE(validateRange(resultOf("delay-multi-speed", Estimate::scalar("tau_s", 1e6, 1e-6)), kTravel));
  EXPECT_FALSE(validateRange(resultOf("delay-multi-speed", Estimate::scalar("tau_s", 5e-3, 1e-6)), kTravel));
}

}  // namespace
}  // namespace probebox::app
