#include "drivers/world/controller.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "fake_box.hpp"
#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::FakeBox;
using testing::seconds;

std::vector<Prompt> multiSpeed() {
  std::vector<Prompt> steps;
  for (const double speed : {5.0, 10.0, 20.0, 30.0, 40.0}) {
    for (const Vector3& normal : {Vector3{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}) {
      steps.push_back({Step{.outward_normal = normal,
                            .retract_direction = normal,
                            .nominal_speed_mm_s = speed,
                            .overtravel_mm = 0.5,
                            .clearance_mm = 0.6}});
    }
  }
  return steps;
}

bool measuresNow(Activity activity) {
  return activity == Activity::approaching || activity == Activity::dwelling || activity == Activity::retracting ||
         activity == Activity::withdrawing;
}

// World, controller and box together, a millisecond at a time. Watches that nothing but a touch comes near the sphere.
class Cycle {
 public:
  explicit Cycle(double loss = 0, std::uint64_t seed = 1)
      : world_{testing::usual(), seed},
        box_{multiSpeed(), std::chrono::milliseconds{3}, loss, seed},
        controller_{controllerFor(testing::usual()), world_.machine(), box_} {}

  void step() {
    ms_ += 1;
    const MonoTime now = seconds(1e-3 * ms_);
    box_.advance(now);
    controller_.advance(now);
    world_.advanceTo(now);
    std::array<Event, 64> events;
    while (world_.poll(events) > 0) continue;
    watch(now);
  }

  // False when it did not come true in time.
  template <class Condition>
  bool until(Condition condition, double at_most_s) {
    for (const int end_ms = ms_ + static_cast<int>(1e3 * at_most_s); ms_ < end_ms;) {
      if (condition()) return true;
      step();
    }
    return condition();
  }
  bool untilSolving(double at_most_s) {
    return until([&] { return box_.state() == RunState::solving; }, at_most_s);
  }
  void wait(double s) {
    until([] { return false; }, s);
  }

  double now_s() const { return 1e-3 * ms_; }
  FakeBox& box() { return box_; }
  World& world() { return world_; }
  const Controller& controller() const { return controller_; }
  std::uint64_t contacts() const { return world_.machine().stylus().contactCount(); }
  bool touching() const { return norm(world_.machine().stylusDisplacementAt(world_.now())) > 0.05; }

 private:
  void watch(MonoTime now) {
    const double outside = norm(world_.machine().positionAt(now) - testing::usual().sphere.centre_mm) - 15.5;
    if (measuresNow(controller_.activity())) return;
    // The nominal centre is wrong by 0.17 mm.
    EXPECT_GT(outside, 0.6 - 0.2) << "at " << now_s() << " s";
  }

  int ms_{};
  World world_;
  FakeBox box_;
  Controller controller_;
};

TEST(Controller, DoesNothingUntilTheBoxAsks) {
  Cycle cycle;
  cycle.wait(2);
  EXPECT_EQ(cycle.world().machine().commandedPosition(), testing::usual().axes.home_mm);
  EXPECT_EQ(cycle.controller().activity(), Activity::asking);
}

TEST(Controller, DoesAllStepsOfAMultiSpeedProcedure) {
  Cycle cycle;
  cycle.box().start(7);
  ASSERT_TRUE(cycle.untilSolving(60));
  EXPECT_LT(cycle.now_s(), 30);
  EXPECT_EQ(cycle.contacts(), 25U);
  cycle.wait(3);
  EXPECT_EQ(cycle.controller().finishedSteps(), 25U);
  EXPECT_EQ(cycle.controller().abandonedSteps(), 0U);
  EXPECT_EQ(cycle.controller().resentMarkers(), 0U);
  EXPECT_EQ(cycle.world().machine().commandedPosition(), testing::usual().axes.home_mm);
}

TEST(Controller, TouchesWhereAndHowItIsPrompted) {
  Cycle cycle;
  cycle.box().start(1);
  for (std::uint32_t step = 0; step < 25; ++step) {
    const Prompt asked = cycle.box().present();
    ASSERT_TRUE(cycle.until([&] { return cycle.controller().activity() == Activity::dwelling; }, 5));
    const Vector3 deflection = cycle.world().machine().stylusDisplacementAt(cycle.world().now());
    EXPECT_GT(dot(unit(deflection), asked.outward_normal), 0.99);
    EXPECT_NEAR(norm(deflection), 0.5, 0.2);
    ASSERT_TRUE(cycle.until([&] { return cycle.controller().activity() == Activity::retracting; }, 5));
    // Constant speed from soon after the apex until the clearance has been passed.
    const Vector3 apex = cycle.world().machine().commandedPosition() -
                         (0.5 + 0.6 + ControllerConfig{}.run_out_mm) * asked.outward_normal;
    ASSERT_TRUE(cycle.until(
        [&] {
          const MonoTime now = cycle.world().now();
          const double travel = dot(cycle.world().machine().positionAt(now) - apex, asked.outward_normal);
          if (travel > 0.125 && travel < 0.5 + 0.6 + 0.5) {
            EXPECT_NEAR(cycle.world().machine().speedAt(now), asked.nominal_speed_mm_s, 1e-9);
          }
          return cycle.controller().activity() == Activity::recording;
        },
        5));
    ASSERT_TRUE(cycle.until([&] { return cycle.box().step() == step + 1; }, 5));
    EXPECT_FALSE(cycle.touching());
  }
}

TEST(Controller, KnowsThePlacesWithAnErrorOfItsOwn) {
  const auto config = controllerFor(testing::usual(), {0.1, 0, -0.1});
  EXPECT_EQ(config.known.sphere.centre_mm, (Vector3{10.1, -20, 29.9}));
  EXPECT_EQ(config.park_mm(), (Vector3{10, -20, 110}));
  EXPECT_EQ(config.dwell(), std::chrono::milliseconds{100});
}

// 0.55 mm off along +X: a move to the place itself would press the stylus by 1.05 mm there, and miss it at -X.
TEST(Controller, PressesByTheOvertravelFromTheContactWhereThePlaceIsOff) {
  const auto off = controllerFor(testing::usual(), {-0.55, 0, 0});
  World world{testing::usual(), 1};
  FakeBox box{multiSpeed(), std::chrono::milliseconds{1}, 0, 1};
  Controller controller{off, world.machine(), box};
  box.start(1);
  std::size_t dwells = 0;
  for (int ms = 1; box.state() != RunState::solving && ms < 60'000; ++ms) {
    const auto before = controller.activity();
    box.advance(seconds(1e-3 * ms));
    controller.advance(seconds(1e-3 * ms));
    world.advanceTo(seconds(1e-3 * ms));
    std::array<Event, 64> events;
    while (world.poll(events) > 0) continue;
    if (before == Activity::dwelling || controller.activity() != Activity::dwelling) continue;
    ++dwells;
    const Vector3 pressed = world.machine().stylusDisplacementAt(world.now());
    EXPECT_NEAR(dot(pressed, box.present().outward_normal), 0.5, 0.03) << "step " << box.step();
  }
  EXPECT_EQ(dwells, 25U);
  EXPECT_EQ(controller.abandonedSteps(), 0U);
}

TEST(Controller, MarksBeginAndEndAtRestAroundTheWholeTouch) {
  Cycle cycle;
  cycle.box().start(1);
  ASSERT_TRUE(cycle.until([&] { return cycle.box().state() == RunState::running; }, 5));
  EXPECT_EQ(cycle.contacts(), 0U);
  EXPECT_TRUE(cycle.world().machine().atRest(cycle.world().now()));
  ASSERT_TRUE(cycle.until([&] { return cycle.box().step() == 1; }, 5));
  EXPECT_EQ(cycle.contacts(), 1U);
  const Contact contact = *cycle.world().machine().stylus().contact(0);
  ASSERT_TRUE(contact.end);
  EXPECT_GT(contact.end->elapsed(cycle.world().now(), 0), 0.06);
}

TEST(Controller, FinishesOverALinkThatLosesMessages) {
  std::uint64_t resent = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Cycle cycle{0.3, seed};
    cycle.box().start(3);
    ASSERT_TRUE(cycle.untilSolving(300)) << "seed " << seed;
    resent += cycle.controller().resentMarkers();
  }
  EXPECT_GT(resent, 20U);
}

TEST(Controller, RepeatsTheStepDuringWhichTheLinkVanished) {
  for (const Activity when :
       {Activity::travelling, Activity::beginning, Activity::approaching, Activity::recording, Activity::ending}) {
    Cycle cycle;
    cycle.box().start(3);
    cycle.until([&] { return cycle.box().step() == 4; }, 20);
    ASSERT_TRUE(cycle.until([&] { return cycle.controller().activity() == when; }, 5));
    cycle.box().cut(true);
    cycle.wait(6);
    EXPECT_FALSE(cycle.touching());
    EXPECT_EQ(cycle.controller().finishedSteps(), 4U);
    cycle.box().cut(false);
    ASSERT_TRUE(cycle.untilSolving(60)) << "vanished in activity " << static_cast<int>(when);
  }
}

TEST(Controller, AbandonsAStepThatTheBoxBelievesIsRunning) {
  Cycle cycle;
  cycle.box().start(3);
  ASSERT_TRUE(cycle.until([&] { return cycle.controller().activity() == Activity::recording; }, 5));
  cycle.box().cut(true);
  cycle.wait(6);
  cycle.box().cut(false);
  ASSERT_TRUE(cycle.untilSolving(60));
  EXPECT_EQ(cycle.box().abandoned(), 1U);
  EXPECT_EQ(cycle.contacts(), 26U);
}

TEST(Controller, WaitsForABoxThatPublishesItsStateLate) {
  Cycle cycle;
  cycle.box().publishLate(std::chrono::milliseconds{200});
  cycle.box().start(3);
  ASSERT_TRUE(cycle.untilSolving(60));
  EXPECT_EQ(cycle.controller().abandonedSteps(), 0U);
  EXPECT_EQ(cycle.contacts(), 25U);
}

TEST(Controller, LeavesTheSphereAndParksWhenTheProcedureIsAborted) {
  for (const Activity when : {Activity::travelling, Activity::settling, Activity::approaching, Activity::dwelling,
                              Activity::retracting, Activity::recording}) {
    Cycle cycle;
    cycle.box().start(3);
    cycle.until([&] { return cycle.box().step() == 2; }, 20);
    ASSERT_TRUE(cycle.until([&] { return cycle.controller().activity() == when; }, 5));
    cycle.box().abort();
    cycle.wait(4);
    EXPECT_EQ(cycle.world().machine().commandedPosition(), testing::usual().axes.home_mm);
    EXPECT_EQ(cycle.controller().activity(), Activity::asking);
    EXPECT_FALSE(cycle.touching());

    cycle.box().start(4);
    EXPECT_TRUE(cycle.untilSolving(40)) << "a new run follows an aborted one";
  }
}

TEST(Controller, DoesNotMoveForAPromptThatMakesNoSense) {
  const auto moves_for = [](auto spoil) {
    Prompt prompt = multiSpeed()[0];
    spoil(prompt);
    World world{testing::usual(), 1};
    FakeBox box{{prompt}, std::chrono::milliseconds{1}, 0, 1};
    Controller controller{controllerFor(testing::usual()), world.machine(), box};
    box.start(1);
    for (int ms = 1; ms < 500; ++ms) {
      box.advance(seconds(1e-3 * ms));
      controller.advance(seconds(1e-3 * ms));
    }
    return world.machine().commandedPosition() != testing::usual().axes.home_mm;
  };
  EXPECT_TRUE(moves_for([](Prompt&) {}));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.outward_normal = {}; }));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.outward_normal[1] = std::nan(""); }));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.retract_direction = -p.outward_normal; }));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.nominal_speed_mm_s = 0; }));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.overtravel_mm = std::nan(""); }));
  EXPECT_FALSE(moves_for([](Prompt& p) { p.clearance_mm = -1; }));
}

}  // namespace
}  // namespace probebox::world
