#include "firmware/app/result_events.hpp"

#include <cmath>
#include <filesystem>
#include <gmock/gmock.h>
#include <numbers>
#include <unistd.h>

#include "firmware/app/standing_keeper.hpp"
#include "firmware/metrology/solve.hpp"

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
  record.binding.subject = subjectOf(dataset);
  if (solved) record.content = *solved;
  return record;
}

template <class T>
T eventOf(const store::Record& record) {
  const auto activation = activationOf(record, kNow);
  EXPECT_TRUE(activation && *activation) << (activation ? "no event" : activation.error().what);
  if (!activation || !*activation) return {};
  const auto* event = std::get_if<T>(&**activation);
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

TEST(ResultEvents, SayWhenNothingIsInForceAnyMore) {
  const auto none = noneInForce("delay", kNow);
  ASSERT_TRUE(none);
  EXPECT_EQ(std::get<DelayActivated>(*none).result_id, 0U);
  EXPECT_EQ(std::get<ScrewActivated>(*noneInForce("screw-z", kNow)).axis, Axis::z);
  EXPECT_FALSE(noneInForce("tool-assembly", kNow)) << "the core does not use it";
}

TEST(ResultEvents, GoBySubjectAndNotByMethod) {
  EXPECT_EQ(subjectNamed("delay-plates"), "delay");
  EXPECT_EQ(subjectNamed("delay"), "delay");
  EXPECT_EQ(subjectNamed("c-axis-alignment"), "centreline");
  metrology::Dataset screw{.method = "screw-calibration", .config = {{"axis", std::string{"Y"}}}, .tables = {}};
  EXPECT_EQ(subjectOf(screw), "screw-y");
}

TEST(StandingCorrection, IsKeptWhenItHasMovedAndNotTooOften) {
  const auto folder = std::filesystem::temp_directory_path() / ("probebox-standing-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  auto store = store::Store::open((folder / "results.db").string());
  ASSERT_TRUE(store) << store.error().what;
  {
    StandingKeeper keeper{*store};
    EXPECT_FALSE(keeper.restore(kNow)) << "nothing was ever served";
    corrections::Snapshot served{};
    served.at = kNow;
    served.correction_mm = {0.05, 0, -0.01};
    keeper.look(served);
    EXPECT_FALSE(StandingKeeper{*store}.restore(kNow)) << "what is not valid is applied by nobody";
    served.valid = true;
    keeper.look(served);
    EXPECT_EQ(StandingKeeper{*store}.restore(kNow)->correction_mm, served.correction_mm);
    const auto first_mm = served.correction_mm;
    served.correction_mm[0] = 0.06;
    served.at += std::chrono::milliseconds{100};
    keeper.look(served);
    EXPECT_EQ(StandingKeeper{*store}.restore(kNow)->correction_mm, first_mm) << "at most once a second";
    keeper.finish(served);
    EXPECT_EQ(StandingKeeper{*store}.restore(kNow)->correction_mm, served.correction_mm) << "the last word";
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace probebox::app
