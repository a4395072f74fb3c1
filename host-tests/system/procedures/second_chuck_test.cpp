#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "on_the_machine.hpp"

// A lathe with a sub-spindle: what is measured, accepted and told of either chuck is its own.
namespace probebox::command {
namespace {

using testing::HasSubstr;

class OnALathe : public OnTheMachine {
 protected:
  OnALathe() {
    // The shipped world with other axes than the shipped ones.
    start([](board::Descriptions& changed) {
      changed = *board::simLatheDescriptions();
      changed.world->part_spindle.point_mm[0] += 0.06;
      changed.world->second_spindle->point_mm[0] -= 0.11;
    });
  }
  nlohmann::ordered_json accepted(std::vector<std::string> run) {
    run.insert(run.begin(), "calibrate");
    for (const auto* word : {"--accept", "--by", "Ada", "--although-it-differs", "--json"}) run.emplace_back(word);
    const auto done = box(run);
    EXPECT_EQ(done.status, 0) << done.err;
    nlohmann::ordered_json found;
    for (const auto& object : done.objects())
      if (object.contains("result")) found = object;
    return found;
  }
  void expectAxis(const nlohmann::ordered_json& found, const board::WorldPartSpindle& truth) {
    // In the middle of its two clampings.
    const double z_mm = truth.point_mm[2] + truth.balls_mm[0][2] + truth.further_mounts[0].shift_mm[2] / 2;
    const double x_mm = truth.point_mm[0] + truth.direction[0] / truth.direction[2] * (z_mm - truth.point_mm[2]);
    EXPECT_NEAR(found["result"]["centre_x_mm"].get<double>(), x_mm, 5 * found["sd"]["centre_x_mm"].get<double>())
        << found;
  }
};

TEST_F(OnALathe, EitherChuckHasResultsOfItsOwn) {
  accepted({"delay-multi-speed"});
  const auto first = accepted({"centreline-x"});
  const auto second = accepted({"centreline-x", "--spindle", "2"});
  expectAxis(first, descriptions_.world->part_spindle);
  expectAxis(second, *descriptions_.world->second_spindle);
  const auto of_first = box({"results", "centreline"}).out, of_second = box({"results", "centreline-2"}).out;
  EXPECT_THAT(of_first, HasSubstr("in force"));
  EXPECT_THAT(of_second, HasSubstr("in force"));
  EXPECT_EQ(box({"rollback", "centreline-2", "--by", "Ada"}).status, 0);
  EXPECT_THAT(box({"status"}).out,
              testing::AllOf(HasSubstr("centreline"), testing::Not(HasSubstr("active    centreline-2"))));
  const auto page = directory_.file("second.html");
  EXPECT_EQ(box({"report", "centreline", "-o", page}).status, 0);
}

TEST_F(OnALathe, HasNoSecondChuckUnlessItSaysSo) {
  accepted({"delay-multi-speed"});
  start([](board::Descriptions& changed) {
    changed = *board::simLatheDescriptions();
    changed.machine.has_second_spindle = false;
  });
  EXPECT_EQ(box({"calibrate", "centreline-x", "--spindle", "2"}).status, 4);
  EXPECT_EQ(box({"calibrate", "periodic-check", "--spindle", "2"}).status, 4);
}

}  // namespace
}  // namespace probebox::command
