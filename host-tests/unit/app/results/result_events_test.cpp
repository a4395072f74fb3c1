#include "firmware/app/results/result_events.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <numbers>

#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/solve.hpp"
#include "host-tests/support/temporary_folder.hpp"

// From what a solver found to what the core hears, by way of the solvers themselves.
namespace probebox::app {
namespace {

constexpr MonoTime kNow{std::chrono::seconds{5}};

store::Record recordOf(const metrology::Dataset& dataset) {
  const auto solved = metrology::solve(dataset);
  EXPECT_TRUE(solved) << (solved ? "" : solved.error().reason);
  store::Record record{};
  record.id = 12;
  record.state = store::State::proposed;
  record.binding.subject = metrology::subjectOf(dataset);
  if (solved) record.content = *solved;
  return record;
}

template <class T>
T eventOf(const store::Record& record) {
  const auto activation = activationOf(record, kNow);
  EXPECT_TRUE(activation && !activation->empty()) << (activation ? "no event" : activation.error().what);
  if (!activation || activation->empty()) return {};
  const auto* event = std::get_if<T>(&activation->front());
  EXPECT_NE(event, nullptr);
  return event != nullptr ? *event : T{};
}

// Readings of a ball that a turning axis carries, which goes through `centre` at Z = 100 and leans by `slope`.
metrology::Dataset alignment(const std::array<double, 2>& centre, const std::array<double, 2>& slope) {
  metrology::Dataset dataset{.method = "c-axis-alignment", .config = {{"sigma_mm", 0.001}}, .tables = {}};
  constexpr std::array<std::string_view, 5> kColumns{"z_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
  auto table = metrology::Table::withColumns("readings", kColumns);
  for (const double z : {50.0, 100.0, 150.0}) {
    for (const double a : {0.0, std::numbers::pi}) {
      for (const double c : {0.0, std::numbers::pi}) {
        const double dz = z - 100;
        table.append({z, a, c, centre[0] + slope[0] * dz + 20 * std::cos(c) - 0.01 * std::cos(a),
                      centre[1] + slope[1] * dz + 20 * std::sin(c) - 0.01 * std::sin(a)});
      }
    }
  }
  dataset.tables.push_back(std::move(table));
  return dataset;
}

// A delay with the gain of its touches; without sd, or not a gain at all, that of the description stays.
TEST(ResultEvents, OfADelayTellTheGainOfItsTouches) {
  store::Record record{};
  record.id = 12;
  record.binding.subject = "delay";
  metrology::Result result;
  result.method = "delay-known-sphere";
  result.estimates = {metrology::Estimate::scalar("tau_s", 5e-3, 1e-6)};
  const std::vector<double> gain{0.98, 0.01, -0.005, -0.012, 1.03, 0.004, 0.006, -0.008, 1.01};
  const auto at_zero = metrology::Estimate::scalar("gain_taken_at_A_rad", 0, std::nullopt);
  const auto eventWith = [&](const std::vector<double>& values, std::vector<double> sd) {
    result.also = {metrology::Estimate::matrix("gain_matrix", 3, values, std::move(sd)), at_zero};
    record.content = result;
    return eventOf<DelayActivated>(record);
  };
  const auto event = eventWith(gain, std::vector<double>(9, 0.0004));
  EXPECT_TRUE(event.has_gain);
  EXPECT_EQ(event.gain_ppm[3], -12'000);
  EXPECT_EQ(event.gain_ppm[8], 1'010'000);
  EXPECT_EQ(event.sd_gain_ppm[4], 400);
  EXPECT_FALSE(eventWith(gain, {}).has_gain) << "nobody knows how good it is";
  EXPECT_FALSE(eventWith(std::vector<double>(9, 1e6), std::vector<double>(9, 1.0)).has_gain);
  result.also = {metrology::Estimate::matrix("gain_matrix", 3, gain, std::vector<double>(9, 0.0004))};
  record.content = result;
  EXPECT_FALSE(eventOf<DelayActivated>(record).has_gain) << "it may be that of a turned probe";
  result.also.clear();
  record.content = result;
  EXPECT_FALSE(eventOf<DelayActivated>(record).has_gain);
}

TEST(ResultEvents, OfAnAlignmentTellTheTurningAxisOverZ) {
  const auto record = recordOf(alignment({330.02, 199.97}, {2e-4, -3e-4}));
  EXPECT_EQ(record.binding.subject, "centreline");
  const auto event = eventOf<CentrelineActivated>(record);
  EXPECT_EQ(event.result_id, 12U);
  EXPECT_NEAR(event.slope[0], 2e-4, 1e-9);
  EXPECT_NEAR(event.slope[1], -3e-4, 1e-9);
  const double at_zero_x = event.centre_mm[0] - event.slope[0] * event.reference_z_mm;
  EXPECT_NEAR(at_zero_x, 330.02 - 2e-4 * 100, 1e-6);
  EXPECT_GT(event.sd_slope[0], 0);
}

TEST(ResultEvents, OfAChuckOnTheSlideTellTheSlidesOwnSlopeAndNeverZero) {
  auto dataset = alignment({330.02, 199.97}, {2e-4, -3e-4});
  dataset.config["heights"] = std::string{"slide"};
  const auto record = recordOf(dataset);
  EXPECT_EQ(record.binding.subject, "centreline-slide");
  const auto event = eventOf<CentrelineActivated>(record);
  EXPECT_NEAR(event.slope[0], 2e-4, 1e-9);
  EXPECT_NEAR(event.slope[1], -3e-4, 1e-9);
  EXPECT_GT(event.sd_slope[0], 0);
  EXPECT_TRUE(noneInForce("centreline-slide", kNow));
}

TEST(ResultEvents, OfTheSecondChuckMoveNothingOfTheMainOne) {
  auto dataset = alignment({330.02, 199.97}, {2e-4, -3e-4});
  dataset.config["spindle"] = 2.0;
  const auto record = recordOf(dataset);
  EXPECT_EQ(record.binding.subject, "centreline-2");
  const auto events = activationOf(record, kNow);
  ASSERT_TRUE(events);
  EXPECT_TRUE(events->empty());
  EXPECT_FALSE(noneInForce("centreline-2", kNow));
  dataset.config["spindle"] = 3.0;
  EXPECT_EQ(metrology::solve(dataset).error().name, "bad-config");
}

// Of one height: no slope, and the height itself.
TEST(ResultEvents, SayTheHeightOfACentrelineWithoutTilts) {
  store::Record record;
  record.binding.subject = "centreline";
  metrology::Result result;
  result.method = "centreline";
  result.estimates = {metrology::Estimate::vector("centre_mm", {330.1, 200.2}, {1e-4, 1e-4})};
  result.also = {metrology::Estimate::scalar("mean_z_mm", -159.993, std::nullopt)};
  record.content = result;
  const auto events = activationOf(record, kNow);
  ASSERT_TRUE(events) << events.error().what;
  const auto& event = std::get<CentrelineActivated>(events->front());
  EXPECT_EQ(event.reference_z_mm, -159.993);
  EXPECT_EQ(event.slope[0], 0);
}

TEST(ResultEvents, OfASpindleThatStoodStillNeverMoveTheTurningAxis) {
  auto dataset = alignment({330.02, 199.97}, {2e-4, -3e-4});
  auto& readings = dataset.tables.front();
  auto& angles = std::ranges::find(readings.columns, "A_rad", &metrology::Column::name)->values;
  auto& x = std::ranges::find(readings.columns, "x_mm", &metrology::Column::name)->values;
  for (std::size_t k = 0; k < angles.size(); ++k) x[k] += 0.01 * std::cos(std::exchange(angles[k], 0.0)) - 0.01;
  auto record = recordOf(dataset);
  EXPECT_EQ(record.binding.subject, "centreline-stylus");
  EXPECT_THAT(activationOf(record, kNow).value(), testing::IsEmpty());
  dataset.config["heights"] = std::string{"slide"};
  record.binding.subject = metrology::subjectOf(dataset);
  const auto refused = activationOf(record, kNow);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("stood still"));
}

// Reports of a ball by a head that swivels by B and is off by `x_mm` at 30 degrees alone, and 0.04 mm sin B everywhere.
metrology::Dataset swivelling(double x_mm) {
  metrology::Dataset dataset{
      .method = "swivel-error",
      .config = {{"swivel_axis", std::vector<double>{0, 1, 0}}, {"sigma_mm", 0.001}, {"model", std::string{"sine"}}},
      .tables = {}};
  constexpr std::array<std::string_view, 5> kColumns{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"};
  auto readings = metrology::Table::withColumns("readings", kColumns);
  for (const double length : {100.0, 200.0}) {
    for (const double b : {-90.0, -30.0, 0.0, 30.0, 90.0}) {
      const double sine = std::sin(b * std::numbers::pi / 180);
      readings.append({b, length, b == 30.0 ? x_mm : 0.0, 0.04 * sine, 3});
    }
  }
  constexpr std::array<std::string_view, 2> kQueries{"B_deg", "L_mm"};
  auto queries = metrology::Table::withColumns("queries", kQueries);
  queries.append({30, 150});
  dataset.tables = {std::move(readings), std::move(queries)};
  return dataset;
}

TEST(ResultEvents, OfASwivelTellItsTermsAndWhatIsLeftByAngle) {
  const auto record = recordOf(swivelling(0.006));
  EXPECT_EQ(record.binding.subject, "swivel-b");
  const auto head = eventOf<SwivelActivated>(record);
  EXPECT_EQ(head.axis, RotaryAxis::b);
  EXPECT_NEAR(head.terms[4], 0.04, 1e-9) << "Y: the factor of sin B";
  const auto events = activationOf(record, kNow);
  ASSERT_EQ(events->size(), 1U + head.rows);
  ASSERT_EQ(head.rows, 5U);
  const auto& last = std::get<ErrorsAtAngle>(events->back());
  EXPECT_EQ(last.of, ErrorsOf::swivel);
  EXPECT_EQ(last.result_id, 12U);
  EXPECT_NEAR(last.angle_rad, std::numbers::pi / 2, 1e-12);
}

// A plate of four balls on C, whose axis passes X 100 and shifts the plate by 0.01 mm along Y where C is turned.
metrology::Dataset turned(const char* axis) {
  metrology::Dataset dataset{.method = "rotary-axis-errors",
                             .config = {{"axis_point_mm", std::vector<double>{100, 0, 0}},
                                        {"axis_direction", std::vector<double>{0, 0, 1}},
                                        {"sigma_mm", 0.001}},
                             .tables = {}};
  if (*axis != 0) dataset.config["axis"] = std::string{axis};
  constexpr std::array<std::string_view, 5> kFirst{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
  auto first = metrology::Table::withColumns("first", kFirst);
  auto second = metrology::Table::withColumns("second", std::span{kFirst}.last(4));
  auto third = metrology::Table::withColumns("third", std::span{kFirst}.last(4));
  for (int ball = 0; ball < 4; ++ball) {
    const double at = ball * std::numbers::pi / 2, z = ball % 2 == 0 ? 40.0 : 60.0;
    for (const double phi : {0.0, 1.0, 2.0, 4.0}) {
      const double shift = phi == 0.0 ? 0.0 : 0.01;
      first.append({phi, ball + 1.0, 100 + 80 * std::cos(at + phi), shift + 80 * std::sin(at + phi), z});
    }
    second.append({ball + 1.0, 100 + 80 * std::cos(at), 80 * std::sin(at), z});
    third.append({ball + 1.0, 80 * std::cos(at), 80 * std::sin(at), z});
  }
  dataset.tables = {std::move(first), std::move(second), std::move(third)};
  return dataset;
}

TEST(ResultEvents, OfATableTellTheAxisItsErrorsAndHowUncertainTheyAre) {
  const auto record = recordOf(turned("C"));
  EXPECT_EQ(record.binding.subject, "rotary-c");
  const auto head = eventOf<RotaryActivated>(record);
  EXPECT_EQ(head.axis, RotaryAxis::c);
  EXPECT_EQ(head.point_mm, (std::array<double, 3>{100, 0, 0}));
  EXPECT_EQ(head.direction, (std::array<double, 3>{0, 0, 1}));
  const auto* six = record.result()->find("six_errors");
  for (std::size_t e = 0; e < 6; ++e) {
    for (std::size_t k = 0; k < 4; ++k) EXPECT_GE(head.sd[e], six->sd[6 * k + e]);
    EXPECT_GT(head.sd[e], 0);
  }
  const auto events = activationOf(record, kNow);
  ASSERT_EQ(events->size(), 5U);
  const auto& row = std::get<ErrorsAtAngle>((*events)[3]);
  EXPECT_EQ(row.of, ErrorsOf::rotary);
  EXPECT_EQ(row.angle_rad, 2.0);
  EXPECT_NEAR(row.errors[1], 0.01, 1e-6);
}

// A pre-travel whose readings say little and whose sphere is uncertain.
store::Record preTravelRecord() {
  metrology::Result result;
  result.method = "pre-travel";
  auto parts = metrology::Estimate::vector("pre_travel_mm", {0.01, 0.002, -0.001, 0.004}, {3e-4, 1e-4, 1e-4, 2e-4});
  parts.uncertainty = {5e-4, 1e-4, 1e-4, 2.5e-4};
  result.estimates = {metrology::Estimate::scalar("first_mm", 1, 0.1), parts};
  result.budget = {{.name = "readings", .type_b = false, .sd = {0.1, 3e-4, 1e-4, 1e-4, 2e-4}},
                   {.name = "sd_effective_diameter_mm", .type_b = true, .sd = {0, 4e-4, 0, 0, 1.5e-4}}};
  store::Record record{};
  record.id = 12;
  record.binding.subject = "pre-travel";
  record.content = result;
  return record;
}

TEST(ResultEvents, GiveAPreTravelItsWholeCovariance) {
  const auto found = preTravelOf(preTravelRecord());
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->covariance[0][0], 25e-8, 1e-15);
  EXPECT_NEAR(found->covariance[1][1], 1e-8, 1e-15);
  EXPECT_NEAR(found->covariance[3][3], 6.25e-8, 1e-15);
  EXPECT_NEAR(found->covariance[0][3], 6e-8, 1e-15) << "one sphere for both";
  EXPECT_NEAR(found->covariance[3][0], 6e-8, 1e-15);
}

TEST(ResultEvents, TellWhichToolAPreTravelIsOf) {
  auto record = preTravelRecord();
  EXPECT_EQ(preTravelOf(record)->tool, 0U);
  record.binding.subject = "pre-travel-2";
  EXPECT_EQ(preTravelOf(record)->tool, 2U);
  ASSERT_TRUE(activationOf(record, kNow));
  EXPECT_TRUE(activationOf(record, kNow)->empty());
}

TEST(ResultEvents, BringTheCombinedUncertaintyIntoForce) {
  store::Record record{};
  record.id = 12;
  record.binding.subject = "delay";
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", 1e-3, 1e-6)};
  record.content = result;
  EXPECT_EQ(eventOf<DelayActivated>(record).sd_s[0], 1e-6) << "of a result that states no other";
  result.estimates[0].uncertainty = {3e-6};
  record.content = result;
  EXPECT_EQ(eventOf<DelayActivated>(record).sd_s[2], 3e-6);
  result.estimates[0].uncertainty = {INFINITY};
  record.content = result;
  EXPECT_FALSE(activationOf(record, kNow));
}

TEST(ResultEvents, OfAnAxisWithoutALetterChangeNothing) {
  const auto record = recordOf(turned(""));
  EXPECT_EQ(record.binding.subject, "rotary-axis-errors");
  EXPECT_TRUE(activationOf(record, kNow)->empty());
}

TEST(ResultEvents, RefuseATableThatTheBoxCannotHold) {
  auto record = recordOf(turned("C"));
  auto& result = std::get<metrology::Result>(record.content);
  for (auto& estimate : result.also) {
    if (estimate.key == "angle_rad") estimate.values.resize(kMostErrorRows + 1);
  }
  const auto activation = activationOf(record, kNow);
  ASSERT_FALSE(activation);
  EXPECT_THAT(activation.error().what, testing::HasSubstr("72 angles"));
}

TEST(ResultEvents, SayWhenNothingIsInForceAnyMore) {
  const auto none = noneInForce("delay", kNow);
  ASSERT_TRUE(none);
  EXPECT_EQ(std::get<DelayActivated>(*none).result_id, 0U);
  EXPECT_EQ(std::get<ScrewActivated>(*noneInForce("screw-z", kNow)).axis, Axis::z);
  EXPECT_EQ(std::get<RotaryActivated>(*noneInForce("rotary-b", kNow)).axis, RotaryAxis::b);
  EXPECT_EQ(std::get<SwivelActivated>(*noneInForce("swivel-a", kNow)).axis, RotaryAxis::a);
  EXPECT_FALSE(noneInForce("rotary-axis-errors", kNow));
  EXPECT_FALSE(noneInForce("tool-assembly", kNow)) << "the core does not use it";
}

TEST(ResultEvents, OfAColdScrewAreItsReadingAlone) {
  store::Record record{};
  record.id = 12;
  record.binding.subject = "screw-reference-y";
  metrology::Result result;
  result.method = "screw-reference";
  result.estimates = {metrology::Estimate::scalar("reference_um", -3.25, 0.02)};
  record.content = result;
  const auto events = activationOf(record, kNow);
  ASSERT_TRUE(events && events->size() == 1);
  const auto& event = std::get<ScrewReferenceActivated>(events->front());
  EXPECT_EQ(event.result_id, 12U);
  EXPECT_EQ(event.axis, Axis::y);
  EXPECT_EQ(event.reading_um, -3.25);
  EXPECT_EQ(std::get<ScrewReferenceActivated>(*noneInForce("screw-reference-z", kNow)).axis, Axis::z);
  EXPECT_FALSE(noneInForce("screw-reference-a", kNow)) << "there is no such screw";
  EXPECT_EQ(metrology::subjectOf({.method = "screw-reference", .config = {{"axis", std::string{"Z"}}}, .tables = {}}),
            "screw-reference-z");
}

// L3 counts from the holder's end face, the length of a tool from the gauge line.
TEST(ResultEvents, OfAnAssemblyAreItsLengthFromTheGaugeLine) {
  store::Record record{};
  record.binding.subject = "assembly-4";
  metrology::Result result;
  result.method = "tool-assembly";
  result.estimates = {metrology::Estimate::scalar("assembled_length_mm", 58.25, 1e-3)};
  record.content = result;
  const auto before = activationOf(record, kNow);
  ASSERT_TRUE(before && before->size() == 1);
  EXPECT_EQ(std::get<ToolLengthActivated>(before->front()).result_id, 0U)
      << "of L3 alone: a rollback to it takes the measured length away";
  result.also = {metrology::Estimate::scalar("gauge_length_mm", 120.25, 1e-3)};
  record.content = result;
  const auto events = activationOf(record, kNow);
  ASSERT_TRUE(events && events->size() == 1);
  EXPECT_EQ(std::get<ToolLengthActivated>(events->front()).length_mm, 120.25);
}

TEST(ResultEvents, GoBySubjectAndNotByMethod) {
  EXPECT_EQ(subjectNamed("delay-plates"), "delay");
  EXPECT_EQ(subjectNamed("delay"), "delay");
  EXPECT_EQ(subjectNamed("c-axis-alignment"), "centreline");
  EXPECT_EQ(subjectNamed("centreline"), "centreline") << "the subject, though a method is called so too";
  EXPECT_EQ(subjectNamed("centreline-limited-access"), "centreline-stylus");
  EXPECT_EQ(subjectNamed("delay-joints"), "delay-joints");
  metrology::Dataset screw{.method = "screw-calibration", .config = {{"axis", std::string{"Y"}}}, .tables = {}};
  EXPECT_EQ(metrology::subjectOf(screw), "screw-y");
  EXPECT_EQ(metrology::subjectOf({.method = "tool-setter", .config = {{"tool", 12.0}}, .tables = {}}), "tool-12");
  EXPECT_EQ(metrology::subjectOf({.method = "tool-setter", .config = {}, .tables = {}}), "tool-setter")
      << "of no tool's number";
  EXPECT_EQ(metrology::subjectOf({.method = "tool-assembly", .config = {{"tool_id", 12.0}}, .tables = {}}),
            "assembly-12");
  EXPECT_EQ(metrology::subjectOf({.method = "sensor-head-calibration", .config = {{"tool", 5.0}}, .tables = {}}),
            "sensor-head-5");
}

}  // namespace
}  // namespace probebox::app
