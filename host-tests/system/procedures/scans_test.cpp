#include <cmath>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "on_the_machine.hpp"

// Scans around the datum sphere through the real programs: the box asks, the emulated control leads the stylus, and
// what a person accepts is in force.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ScanOnTheMachine : public OnTheMachine, public testing::WithParamInterface<std::string> {
 protected:
  ScanOnTheMachine() : OnTheMachine{4} {}  // a scan is spoilt by streams that fall silent, as on a busy computer
  double trueTau_s() const {
    const auto& delays = descriptions_.world->delays;
    return delays.tau_machine_s[0] - delays.tau_probe_s;
  }
};

TEST_P(ScanOnTheMachine, FindsTheDelayThatComesIntoForce) {
  const auto& method = GetParam();
  EXPECT_THAT(box({"calibrate", method, "--angles", "3"}).err, HasSubstr("rotary angles"));
  const auto saved = directory_.file("scan");
  const auto run = box({"calibrate", method, "--save", saved, "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  nlohmann::ordered_json proposed, step;
  for (const auto& object : run.objects()) {
    if (object.contains("result")) proposed = object;
    if (object.value("kind", "") == "scan") step = object;
  }
  ASSERT_FALSE(proposed.is_null()) << run.out;
  EXPECT_EQ(step["kind"], "scan");
  EXPECT_EQ(step["steps"], 6) << "three speeds, in either sense";
  EXPECT_THAT(step["prompt"].get<std::string>(), HasSubstr("sphere"));
  const double tau_s = proposed["result"]["tau_s"], sd_s = proposed["sd"]["tau_s"];
  EXPECT_LT(std::abs(tau_s - trueTau_s()), 5 * sd_s) << tau_s << " instead of " << trueTau_s();
  EXPECT_LT(sd_s, 1e-5);
  EXPECT_GT(sd_s, 1e-7);

  const auto solved = probebox({"solve", "--json", saved});
  ASSERT_EQ(solved.status, 0) << solved.out << solved.err;
  EXPECT_EQ(solved.object()["result"]["tau_s"], proposed["result"]["tau_s"]);
  EXPECT_EQ(solved.object()["sd"]["tau_s"], proposed["sd"]["tau_s"]);
  EXPECT_TRUE(solved.object()["warnings"].empty()) << solved.out;

  const auto id = std::to_string(proposed["id"].get<int>());
  const auto accepted = box({"accept", id, "--by", "Ada"});
  ASSERT_EQ(accepted.status, 0) << accepted.err;
  const auto in_force = box({"info", "--json"}).object()["delay"];
  for (std::size_t axis = 0; axis < 2; ++axis)
    EXPECT_EQ(in_force["tau_s"][axis], proposed["result"]["tau_s"]) << accepted.out;
  EXPECT_EQ(in_force["sd_s"][2], 0) << "a scan at one height tells nothing of Z";
  EXPECT_EQ(box({"report", id, "-o", directory_.file("scan.html")}).status, 0);
}

INSTANTIATE_TEST_SUITE_P(Methods, ScanOnTheMachine, testing::Values("delay-stepped-scan", "delay-contour"));

}  // namespace
}  // namespace probebox::command
