#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "obedient_machine.hpp"

// A live method that exists in this file alone: nothing else has to know it.
namespace probebox::procedure {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

metrology::Solved countTouches(const metrology::Dataset& dataset) {
  metrology::Result result;
  metrology::Estimate estimate;
  estimate.key = "touches";
  estimate.values = {static_cast<double>(dataset.table("touches")->rows())};
  result.estimates.push_back(std::move(estimate));
  return result;
}

constexpr metrology::MethodKey kKeys[]{{"passes", metrology::kNeeded, "how often the sphere was touched"}};
const metrology::Method kSolver{.name = "made-up",
                                .title = "Made up",
                                .equations = "none",
                                .source = "this test",
                                .solver = countTouches,
                                .tables = {},
                                .keys = kKeys,
                                .results = {}};

constexpr Fact kGain{.place = "`[probe] gain`",
                     .known = [](const Facts& facts) { return facts.stylus_ball_diameter_mm > 0; },
                     .missing = "a stylus ball: describe it."};
constexpr std::array kNeeds{&kGain};

// Touches from above until the third pass is done: each pass is known only when the one before it was measured.
constexpr Poses kOnePerPass{
    .count = [](const ProcedureOptions&, const LoopState& state) { return static_cast<std::size_t>(state.values[0]); },
    .at = [](const ProcedureOptions&, const LoopState&,
             std::size_t index) { return Pose{.note = {static_cast<double>(index)}}; }};

constinit const LiveMethod kMadeUp{
    .number = 60'000,
    .solver = &kSolver,
    .steps = "three passes",
    .needs = kNeeds,
    .sides = std::span{kSphereSides}.last<1>(),
    .poses = kOnePerPass,
    .usual = touchesAt(3, 7),
    .prompt = [](const Plan&, std::size_t step) { return "pass by hand, step " + std::to_string(step); },
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built{touchesOf(run), {}, {}};
          built.dataset.config["passes"] = run.recording.touches().back().request.note[0] + 1;
          return built;
        },
    .loops = {.first = {{1}},
              .most = {{3}},
              .next = [](const FinishedRun& run, const RunDataset&) -> std::optional<Solved> {
                const auto done = static_cast<std::uint8_t>(run.recording.touches().size() / 2);
                if (done == 3) return std::nullopt;
                return Solved{.run = 0, .at = {}, .loops = static_cast<std::uint8_t>(done + 1)};
              },
              .after = [](const LoopState&, const ProcedureOptions&, const Solved& solved) -> std::optional<LoopState> {
                return LoopState{{static_cast<double>(solved.loops)}};
              }}};
constexpr std::array kMethods{&kMadeUp};

TEST(AMadeUpMethod, RunsFromItsNumberToItsAnswer) {
  Procedure procedure{kMethods, capture::Capacity{}};
  procedure.start({.run = 4, .method = 60'000, .at = {}});
  ASSERT_EQ(procedure.progress().state, State::waiting);
  EXPECT_EQ(procedure.progress().method, &kMadeUp);
  EXPECT_EQ(promptFor(procedure.plan(), 1), "pass by hand, step 1");
  ObedientMachine machine{procedure};
  const capture::Scales scales{.mm_per_count = {1e-6, 1e-6, 1e-6}, .nominal_period = Nanoseconds{1'000'000}};
  RunDataset built;
  for (int pass = 1; pass <= 3; ++pass) {
    while (procedure.progress().state == State::waiting) machine.touch();
    ASSERT_TRUE(procedure.takeReadyToSolve()) << pass;
    built = runDataset(kMadeUp, procedure.recording(), scales, {});
    auto next = nextLoop(kMadeUp, procedure.recording(), scales, {}, built);
    ASSERT_EQ(next.has_value(), pass < 3);
    if (!next) break;
    next->run = 4;
    procedure.solved(*next);
  }
  EXPECT_EQ(built.dataset.method, "made-up");
  EXPECT_EQ(std::get<double>(built.dataset.config.at("passes")), 3);
  const auto solved = metrology::solve(built.dataset, kSolver);
  ASSERT_TRUE(solved);
  EXPECT_THAT(solved->find("touches")->values, ElementsAre(6));
  procedure.solved({.run = 4, .refused = false, .result_id = 9, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::proposed);
}

TEST(AMadeUpMethod, IsReadiedAndRefusedByItsDescriptor) {
  Facts facts;
  EXPECT_EQ(whyUnready(kMadeUp, facts, false)->what, "made-up needs a stylus ball: describe it.");
  facts.stylus_ball_diameter_mm = 6;
  EXPECT_FALSE(whyUnready(kMadeUp, facts, false)) << "it finds no place, so it needs no delay";
  EXPECT_THAT(validate(kMadeUp, {.angles = 3}, 1)->what,
              testing::AllOf(HasSubstr("made-up"), HasSubstr("rotary angles")));
  EXPECT_FALSE(validate(kMadeUp, {}, 1));
  ProcedureOptions asked;
  asked.turns = 2;
  const auto ready = readied(kMadeUp, asked, facts, {});
  ASSERT_FALSE(ready);
  EXPECT_EQ(ready.error().because, Obstacle::option);
}

TEST(AMadeUpMethod, IsUnknownToABoxThatDoesNotListIt) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  procedure.start({.run = 4, .method = 60'000, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::idle);
}

}  // namespace
}  // namespace probebox::procedure
