#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "refusal.hpp"

// The poses in which methods that read one ball are planned.
namespace probebox::procedure {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A and C of every reading, in degrees.
std::vector<std::pair<double, double>> posesOf(const LiveMethod& method, const ProcedureOptions& options = {}) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  std::vector<std::pair<double, double>> poses;
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    EXPECT_TRUE(plan->steps[k].turns);
    EXPECT_EQ(plan->steps[k].feature, Feature::part_ball);
    EXPECT_EQ(touch.ball, 1);
    EXPECT_EQ(touch.reading, k / 5);
    if (k % 5 != 0) continue;
    poses.emplace_back(std::round(touch.rotary_angles_rad[0] * 180 / std::numbers::pi),
                       std::round(touch.rotary_angles_rad[2] * 180 / std::numbers::pi));
  }
  return poses;
}

using Turns = std::pair<double, double>;

TEST(BallPlans, TurnBothSpindlesIndependentlyOrTogether) {
  const auto two_by_two = ElementsAre(Turns{0, 0}, Turns{0, 180}, Turns{180, 0}, Turns{180, 180}, Turns{0, 0});
  EXPECT_THAT(posesOf(kSpindleOffset2x2), two_by_two)
      << "C turns between any two readings, and the first pose ends the run";
  EXPECT_THAT(posesOf(kPeriodicCheck), two_by_two);
  EXPECT_THAT(posesOf(kSpindleOffsetFour),
              ElementsAre(Turns{0, 0}, Turns{90, 90}, Turns{180, 180}, Turns{270, 270}, Turns{0, 0}));
}

TEST(BallPlans, StayWithinReach) {
  const auto method = kCentrelineLimitedAccess;
  EXPECT_THAT(posesOf(method), ElementsAre(Turns{0, -40}, Turns{0, 0}, Turns{0, 40}, Turns{0, -40}));
  EXPECT_THAT(posesOf(method, {.arc_rad = std::numbers::pi / 3, .angles = 5}),
              ElementsAre(Turns{0, -30}, Turns{0, -15}, Turns{0, 0}, Turns{0, 15}, Turns{0, 30}, Turns{0, -30}));
  EXPECT_THAT(refusal(method, {.arc_rad = 0.4}), testing::AllOf(HasSubstr("30 to"), HasSubstr("360 degrees")));
  EXPECT_THAT(refusal(method, {.angles = 1}), testing::AllOf(HasSubstr("2 to"), HasSubstr("30 angles")));
}

TEST(BallPlans, TakeNoOptionsThatWouldChangeNothing) {
  for (const auto* method : {&kSpindleOffset2x2, &kSpindleOffsetFour, &kPeriodicCheck}) {
    EXPECT_THAT(refusal(*method, {.balls = 2}), HasSubstr("balls"));
    EXPECT_THAT(refusal(*method, {.angles = 4}), HasSubstr("rotary angles"));
  }
}

// Tilts of every reading with the number of its touches, and C.
struct Tilted {
  double tilt_deg{}, c_deg{};
  std::vector<std::array<double, 3>> sides;
};

std::vector<Tilted> tiltsOf(const ProcedureOptions& options) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kTablePivot, options);
  std::vector<Tilted> readings;
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& step = plan->steps[k];
    EXPECT_TRUE(step.turns);
    EXPECT_EQ(step.b_moves, BMoves::table);
    if (step.touch.reading == readings.size()) {
      const auto& angles = step.touch.rotary_angles_rad;
      EXPECT_EQ(angles[0], 0);
      readings.push_back({angles[1] * 180 / std::numbers::pi, std::round(angles[2] * 180 / std::numbers::pi), {}});
    }
    readings.back().sides.push_back(step.touch.outward_normal);
  }
  return readings;
}

TEST(TiltPlans, TiltTheTableWhileCStandsAndTouchNoStem) {
  const auto usual = tiltsOf({});
  ASSERT_EQ(usual.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(usual[k].tilt_deg, k % 2 == 0 ? -90 : 0);
    EXPECT_EQ(usual[k].c_deg, k < 2 ? 0 : 180);
  }
  // Right-handed about X: what stood up lies towards +Y, and the stem comes from -Y.
  EXPECT_THAT(usual[0].sides, testing::UnorderedElementsAre(ElementsAre(1, 0, 0), ElementsAre(-1, 0, 0),
                                                            ElementsAre(0, 1, 0), ElementsAre(0, 0, 1)));
  EXPECT_EQ(usual[1].sides.size(), 5U);

  ProcedureOptions about_y{.b_count = 3, .b_axis = {0, -1, 0}};
  about_y.b_angles_rad = {-std::numbers::pi / 2, 0, std::numbers::pi / 4};
  const auto other = tiltsOf(about_y);
  ASSERT_EQ(other.size(), 6U);
  EXPECT_THAT(other[0].sides, testing::Not(testing::Contains(ElementsAre(-1, 0, 0))))
      << "left-handed about Y by -90: the ball lies towards +X";
  EXPECT_EQ(other[0].sides.size(), 4U);
  EXPECT_EQ(other[2].sides.size(), 5U) << "at 45 degrees the stylus passes the stem";
}

TEST(TiltPlans, AreOfTiltsThatTellAnAxisAndNameThemInTheirPrompts) {
  const auto method = kTablePivot;
  ProcedureOptions options{.b_count = 1, .b_axis = {1, 0, 0}};
  EXPECT_THAT(refusal(method, options), testing::AllOf(HasSubstr("2 to"), HasSubstr("6 angles")));
  options.b_count = 7;
  EXPECT_THAT(refusal(method, options), testing::AllOf(HasSubstr("2 to"), HasSubstr("6 angles")));
  options.b_count = 2;
  options.b_angles_rad = {0, 4};
  EXPECT_THAT(refusal(method, options), testing::AllOf(HasSubstr("-180"), HasSubstr("180 degrees")));
  options.b_angles_rad = {0, 1};
  options.b_axis = {0, 0, 1};
  EXPECT_THAT(refusal(method, options), HasSubstr("along X"));
  EXPECT_THAT(refusal(kCentreline, {.b_axis = {1, 0, 0}}), HasSubstr("angles of"));
  EXPECT_THAT(refusal(method, {.angles = 3}), HasSubstr("rotary angles"));

  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, {});
  EXPECT_EQ(promptFor(*plan, 0),
            "touch 1 of 18: the table at a tilt of -90 deg, A at 0 and C at 0 deg; +X side of ball 1, 0.5 mm deep, "
            "retract at 15 mm/s until 1.5 mm beyond the clearance of 0.6 mm");
}

Plan planOf(const LiveMethod& method, const ProcedureOptions& options = {}) {
  Plan plan;
  EXPECT_FALSE(validate(method, options, std::numeric_limits<double>::infinity()));
  fill(plan, method, options);
  return plan;
}

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

TEST(SwivelPlans, TouchFromTheSideOfTheHeadAndNoStem) {
  for (const auto* method : {&kSwivelError, &kHeadPivot}) {
    const auto plan = std::make_unique<Plan>(planOf(*method));
    for (std::size_t k = 0; k < plan->step_count; ++k) {
      const auto& step = plan->steps[k];
      EXPECT_EQ(step.feature, Feature::datum_sphere);
      EXPECT_EQ(step.b_moves, BMoves::head);
      const double b_rad = step.touch.rotary_angles_rad[1];
      // Right-handed about Y: from the sphere the spindle is seen towards +X at 90 degrees.
      const std::array<double, 3> spindle{std::sin(b_rad), 0, std::cos(b_rad)};
      EXPECT_GE(dot(step.touch.outward_normal, spindle), -1e-12) << "nothing reaches the far side";
      EXPECT_LE(dot(step.touch.outward_normal, {0, 0, -1}), 0.8) << "the stem holds the sphere from below";
      EXPECT_NEAR(dot(step.touch.outward_normal, step.touch.outward_normal), 1, 1e-12);
    }
  }
}

TEST(SwivelPlans, ReadEveryAngleWithEveryToolAndEveryAngleOfA) {
  const auto swivels = std::make_unique<Plan>(planOf(kSwivelError));
  EXPECT_EQ(swivels->step_count, 2U * 2U * (5 + 5 + 4) + 2U * 5);
  EXPECT_EQ(swivels->steps[65].touch.tool, 1U) << "both angles of A at the first stop are read again";
  EXPECT_EQ(swivels->steps[65].touch.rotary_angles_rad, swivels->steps[5].touch.rotary_angles_rad);
  EXPECT_EQ(swivels->steps[0].touch.tool, 1U);
  EXPECT_EQ(swivels->steps[28].touch.tool, 2U);
  EXPECT_NEAR(swivels->steps[5].touch.rotary_angles_rad[0], std::numbers::pi, 1e-12) << "A turns at one stop of B";
  EXPECT_EQ(swivels->steps[5].touch.rotary_angles_rad[1], swivels->steps[0].touch.rotary_angles_rad[1]);
  EXPECT_EQ(promptFor(*swivels, 38),
            "touch 39 of 66: tool 2, the head at B 45 deg, A at 0 and C at 0 deg; (0.707, 0.000, -0.707) side of the "
            "sphere, 0.5 mm deep, retract at 15 mm/s until 1.5 mm beyond the clearance of 0.6 mm");

  const auto pivot = std::make_unique<Plan>(planOf(kHeadPivot));
  EXPECT_EQ(pivot->step_count, 2U * (5 + 5 + 4) + 5);
  EXPECT_EQ(pivot->steps[0].touch.tool, 0U) << "whichever is there";
  EXPECT_NEAR(pivot->steps[27].touch.rotary_angles_rad[0], std::numbers::pi, 1e-12);

  const auto spindle = std::make_unique<Plan>(planOf(kAAxisAlignment, {.tool_count = 3, .tools = {7, 8, 9}}));
  EXPECT_EQ(spindle->step_count, 65U);
  EXPECT_EQ(spindle->steps[60].touch.tool, 7U);
  EXPECT_EQ(spindle->steps[59].touch.tool, 9U);
  EXPECT_EQ(spindle->steps[59].b_moves, BMoves::nothing);
  EXPECT_EQ(spindle->steps[59].feature, Feature::part_ball);
}

TEST(SwivelPlans, NeedWhatTheDescriptionsSay) {
  Facts facts;
  const auto unready = [&](const LiveMethod& method) {
    const auto why = whyUnready(method, facts, true);
    return why ? why->what : "";
  };
  EXPECT_THAT(unready(kSwivelError),
              testing::AllOf(HasSubstr("[swivel_head]"), HasSubstr("angles_deg"), HasSubstr("pivot_mm")));
  EXPECT_THAT(unready(kHeadPivot), HasSubstr("[swivel_head] axis"));
  EXPECT_THAT(unready(kAAxisAlignment), HasSubstr("[probe_tools] numbers"));
  facts.swivel_head = HeadFacts{.b = {.axis = {0, 1, 0}, .count = 2, .angles_rad = {0, 1}, .sigma_rad = 0},
                                .pivot_mm = {},
                                .ball_mm = {},
                                .sd_ball_mm = {}};
  facts.probe_tools = {.count = 2, .numbers = {3, 5}, .lengths_mm = {100, 109}};
  EXPECT_THAT(unready(kSwivelError), HasSubstr("10 mm"));
  EXPECT_THAT(unready(kHeadPivot), HasSubstr("ball_mm"));
  facts.probe_tools.lengths_mm[1] = 111;
  facts.swivel_head->ball_mm.emplace();
  for (const auto* method : {&kSwivelError, &kHeadPivot, &kAAxisAlignment}) {
    EXPECT_EQ(unready(*method), "");
    EXPECT_THAT(whyUnready(*method, facts, false)->what, HasSubstr("calibrate"));
    EXPECT_TRUE(method->finds_a_place);
  }
  const auto options = described(kSwivelError, {}, facts).value();
  EXPECT_EQ(options.b_count, 2);
  EXPECT_EQ(options.tool_count, 2);
  EXPECT_THAT(options.tools, ElementsAre(3, 5, 0, 0));
  EXPECT_EQ(described(kHeadPivot, {}, facts).value().tool_count, 0);
  EXPECT_THAT(refusal(kAAxisAlignment, {.tool_count = 1, .tools = {3}}),
              testing::AllOf(HasSubstr("2 to"), HasSubstr("4 tools")));
  EXPECT_THAT(refusal(kHeadPivot, {.tool_count = 2, .tools = {3, 5}}), HasSubstr("tools"));
}

TEST(TiltPlans, TakeAxisAndTiltsFromTheDescription) {
  Facts facts;
  EXPECT_THAT(whyUnready(kTablePivot, facts, true)->what,
              testing::AllOf(HasSubstr("[tilting_table]"), HasSubstr("tilts_deg")));
  facts.tilting_table = BFacts{.axis = {0, 1, 0}, .count = 3, .angles_rad = {-1, 0, 1}, .sigma_rad = 0};
  EXPECT_THAT(whyUnready(kTablePivot, facts, false)->what, HasSubstr("calibrate"));
  EXPECT_FALSE(whyUnready(kTablePivot, facts, true));
  EXPECT_TRUE(kTablePivot.finds_a_place);
  const auto options = described(kTablePivot, {.overtravel_mm = 0.3}, facts).value();
  EXPECT_EQ(options.overtravel_mm, 0.3);
  EXPECT_EQ(options.b_count, 3);
  EXPECT_THAT(options.b_angles_rad, ElementsAre(-1, 0, 1, 0, 0, 0));
  EXPECT_THAT(options.b_axis, ElementsAre(0, 1, 0));
  EXPECT_EQ(described(kCentreline, {}, facts).value().b_count, 0);
}

TEST(BallPlans, NeedADelayAndThePeriodicCheckItsBall) {
  Facts facts;
  EXPECT_THAT(whyUnready(kPeriodicCheck, facts, true)->what, HasSubstr("[periodic_check] ball_diameter_mm"));
  facts.checked_ball.emplace();
  EXPECT_THAT(whyUnready(kPeriodicCheck, facts, false)->what, HasSubstr("calibrate"));
  EXPECT_FALSE(whyUnready(kPeriodicCheck, facts, true));
  for (const auto* method : {&kSpindleOffset2x2, &kSpindleOffsetFour, &kCentrelineLimitedAccess}) {
    EXPECT_THAT(whyUnready(*method, facts, false)->what, HasSubstr("calibrate"));
    EXPECT_TRUE(method->finds_a_place);
  }
}

TEST(BallPlans, ReadAPlateAtEveryStopAndOnceMoreWhereItBegan) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kRotaryAxisErrors, {.angles = 4, .balls = 3});
  ASSERT_EQ(plan->step_count, 5U * 3U * 5U);
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    const std::size_t reading = k / 5, stop = reading / 3;
    EXPECT_EQ(touch.reading, reading);
    EXPECT_EQ(touch.ball, reading % 3 + 1);
    EXPECT_NEAR(touch.rotary_angles_rad[2], stop < 4 ? static_cast<double>(stop) * std::numbers::pi / 2 : 0.0, 1e-12);
  }
  EXPECT_EQ(refusal(kRotaryAxisErrors, {}), "");
  EXPECT_THAT(refusal(kRotaryAxisErrors, {.balls = 2}), testing::AllOf(HasSubstr("3 to"), HasSubstr("7 balls")));
  EXPECT_THAT(refusal(kRotaryAxisErrors, {.angles = 12}), HasSubstr("195 touches"));
}

TEST(BallPlans, ReadAPlateAtEveryTiltOfTheTableAndOnceMoreLevel) {
  const LiveMethod& method = kRotaryAxisErrors;
  const ProcedureOptions options{
      .balls = 3, .axis = 5, .b_count = 3, .b_angles_rad = {-1.5, -0.5, 0.3}, .b_axis = {1, 0, 0}};
  EXPECT_EQ(refusal(method, options), "");
  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  std::vector<double> tilts_rad;
  std::uint32_t reading = ~0U;
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& step = plan->steps[k];
    EXPECT_EQ(step.b_moves, BMoves::table);
    EXPECT_EQ(step.touch.rotary_angles_rad[2], 0) << "C stands still";
    if (step.touch.reading == reading) continue;
    reading = step.touch.reading;
    EXPECT_EQ(step.touch.ball, reading % 3 + 1);
    tilts_rad.push_back(step.touch.rotary_angles_rad[1]);
  }
  EXPECT_THAT(tilts_rad, ElementsAre(-1.5, -1.5, -1.5, -0.5, -0.5, -0.5, 0.3, 0.3, 0.3, 0, 0, 0));
  EXPECT_LT(plan->step_count, 12U * 5U) << "a stem is in the way of a side at -1.5 rad";
  auto with_angles = options;
  with_angles.angles = 4;
  EXPECT_THAT(refusal(method, with_angles), HasSubstr("rotary angles"));
  EXPECT_THAT(refusal(method, {.balls = 3, .axis = 1}), HasSubstr("B or"));
  EXPECT_EQ(refusal(method, {.balls = 3, .axis = 6}), "");
  EXPECT_THAT(refusal(method, {.balls = 3, .b_count = 2, .b_axis = {1, 0, 0}}), HasSubstr("angles of"));
  EXPECT_THAT(refusal(kCentreline, {.axis = 5}), HasSubstr("options axis"));
}

TEST(BallPlans, KnowTheAxisBThatAPlateIsTurnedBy) {
  const LiveMethod& method = kRotaryAxisErrors;
  const ProcedureOptions about_b{.axis = kAxisB};
  Facts facts;
  const auto unready = [&] {
    const auto ready = readied(method, about_b, facts, {});
    return ready ? "" : ready.error().what;
  };
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .balls_mm = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  EXPECT_THAT(unready(), HasSubstr("[tilting_table]"));
  facts.tilting_table = BFacts{.axis = {0, 1, 0}, .count = 2, .angles_rad = {-1, 0}, .sigma_rad = 0};
  EXPECT_THAT(unready(), HasSubstr("b_axis_point_mm"));
  facts.ball_plate->b_axis_point_mm = {{330, 200, -260}};
  EXPECT_EQ(unready(), "");
  const auto options = readied(method, about_b, facts, {}).value();
  EXPECT_EQ(options.b_count, 2);
  EXPECT_THAT(options.b_axis, ElementsAre(0, 1, 0));
  EXPECT_EQ(readied(method, {}, facts, {}).value().b_count, 0);
}

TEST(BallPlans, ReadBallsAtTheirStationsInEveryMount) {
  const LiveMethod& method = kRotaryAxisErrors;
  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, {.angles = 3, .balls = 6, .stations = 2, .mounts = 2});
  ASSERT_EQ(plan->step_count, 2U * (3 * 2 + 6) * 5);
  std::vector<int> balls, stops, mounts;
  for (std::size_t k = 0; k < plan->step_count; k += 5) {
    const auto& touch = plan->steps[k].touch;
    balls.push_back(touch.ball);
    stops.push_back(static_cast<int>(touch.note[0]));
    mounts.push_back(touch.mount);
  }
  // A third of a turn carries ball 5 to where ball 1 was.
  EXPECT_THAT(std::vector(balls.begin(), balls.begin() + 12), ElementsAre(1, 2, 5, 6, 3, 4, 1, 2, 3, 4, 5, 6));
  EXPECT_THAT(std::vector(stops.begin(), stops.begin() + 12), ElementsAre(1, 1, 2, 2, 3, 3, 0, 0, 0, 0, 0, 0));
  EXPECT_EQ(mounts.front(), 1);
  EXPECT_EQ(mounts.back(), 2);
  EXPECT_EQ(promptFor(*plan, 0).find("mount"), std::string::npos);
  EXPECT_THAT(promptFor(*plan, plan->step_count - 1), HasSubstr("mount 2"));
  EXPECT_THAT(refusal(method, {.angles = 3, .balls = 6, .stations = 2}), HasSubstr("need 3"));
  EXPECT_THAT(refusal(method, {.angles = 3, .balls = 6, .stations = 7}), HasSubstr("6 balls"));
  EXPECT_THAT(refusal(method, {.angles = 3, .mounts = 5}), testing::AllOf(HasSubstr("1 to"), HasSubstr("4 mounts")));
  EXPECT_THAT(refusal(kCentreline, {.mounts = 2}), testing::AllOf(HasSubstr("stations"), HasSubstr("mounts")));
}

TEST(BallPlans, ToldOfAClampingSayThatTheBallGoesFurtherOut) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kCentrelineX, {.angles = 2, .mounts = 2});
  EXPECT_THAT(promptFor(*plan, 0), testing::Not(HasSubstr("further out")));
  EXPECT_THAT(promptFor(*plan, plan->step_count - 1), HasSubstr("ball clamped further out, in mount 2"));
}

// Instead of a run whose result could not come into force.
TEST(BallPlans, AreRefusedWhereTheCorrectionCannotInterpolateTheAngles) {
  const LiveMethod& method = kRotaryAxisErrors;
  Facts facts;
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .balls_mm = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  facts.tilting_table = BFacts{.axis = {1, 0, 0}, .count = 2, .angles_rad = {-std::numbers::pi / 2, 0}, .sigma_rad = 0};
  const ProcedureOptions arc{.arc_rad = 3, .angles = 4, .balls = 3}, about_b{.balls = 3, .axis = 5};
  EXPECT_FALSE(method.why_unfit(arc, facts));
  facts.by_harmonics = {false, false, true};
  EXPECT_THAT(method.why_unfit(arc, facts)->what, HasSubstr("between_c"));
  EXPECT_TRUE(method.why_unfit({.angles = 2, .balls = 3}, facts));
  EXPECT_FALSE(method.why_unfit({.angles = 4, .balls = 3}, facts));
  EXPECT_FALSE(method.why_unfit(about_b, facts)) << "B has its own";
  facts.by_harmonics = {false, true, false};
  EXPECT_THAT(method.why_unfit(about_b, facts)->what, HasSubstr("between_b"));
}

TEST(BallPlans, TurnAPlateByItsPitchWhereItsStationsAreCorrected) {
  const LiveMethod& method = kRotaryAxisErrors;
  Facts facts;
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .station_correction = true, .balls_mm = {}};
  facts.ball_plate->balls_mm.resize(6);
  EXPECT_FALSE(method.why_unfit({.angles = 6, .balls = 6}, facts));
  EXPECT_FALSE(method.why_unfit({.angles = 3, .balls = 6}, facts));
  facts.tilting_table = BFacts{.axis = {1, 0, 0}, .count = 2, .angles_rad = {-std::numbers::pi / 3, 0}, .sigma_rad = 0};
  facts.ball_plate->b_axis_point_mm.emplace();
  EXPECT_FALSE(method.why_unfit({.balls = 6, .axis = 5}, facts));
  facts.tilting_table->angles_rad[1] = 0.2;
  EXPECT_THAT(method.why_unfit({.balls = 6, .axis = 5}, facts)->what, HasSubstr("multiples"));
  EXPECT_THAT(method.why_unfit({.angles = 3, .balls = 5}, facts)->what, HasSubstr("--heights 6"));
  for (const ProcedureOptions& other : {ProcedureOptions{.angles = 4, .balls = 6}, ProcedureOptions{.balls = 6},
                                        ProcedureOptions{.arc_rad = 3, .angles = 3, .balls = 6}})
    EXPECT_THAT(method.why_unfit(other, facts)->what, HasSubstr("360/6"));
}

TEST(BallPlans, ReadNoMoreBallsThanThePlateHas) {
  const LiveMethod& method = kRotaryAxisErrors;
  Facts facts;
  EXPECT_THAT(whyUnready(method, facts, true)->what, HasSubstr("[ball_plate]"));
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .balls_mm = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  EXPECT_THAT(whyUnready(method, facts, false)->what, HasSubstr("calibrate"));
  EXPECT_FALSE(whyUnready(method, facts, true));
  EXPECT_FALSE(method.why_unfit({}, facts));
  EXPECT_FALSE(method.why_unfit({.balls = 3}, facts));
  EXPECT_THAT(method.why_unfit({.balls = 4}, facts)->what, testing::AllOf(HasSubstr("3 balls"), HasSubstr("but 4")));
  EXPECT_EQ(kCAxisAlignment.why_unfit, nullptr);
}

}  // namespace
}  // namespace probebox::procedure
