#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "box_process.hpp"
#include "box_rights.hpp"
#include "host_command.hpp"
#include "played_machine.hpp"

namespace probebox::vm {

// The whole daemon, without privileges, on a machine that is played through devices of the kernel.
class BoxOnAMachine : public testing::Test {
 protected:
  static constexpr const char* kUri = "tcp:127.0.0.1:7627";

  explicit BoxOnAMachine(bool homes = true) : homes_{homes}, machine{config, "127.0.0.1:7627", homes} {}

  static HostCommand command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-u", kUri});
    arguments.emplace_back("--json");
    return {HostUser::stranger, arguments};
  }
  // Asks until the box answers.
  static nlohmann::json status() {
    std::string refused;
    for (int tries = 0; tries < 100; ++tries) {
      auto asked = command({"status"});
      if (asked.status() == 0) return nlohmann::json::parse(asked.out());
      std::printf("status: %s", asked.err().c_str());
      refused = asked.err();
      std::this_thread::sleep_for(std::chrono::milliseconds{300});
    }
    throw std::runtime_error{"the box does not answer: " + refused};
  }
  static bool eventually(const std::function<bool()>& is_so) {
    for (int tries = 0; tries < 200; ++tries, std::this_thread::sleep_for(std::chrono::milliseconds{300})) {
      if (is_so()) return true;
    }
    return false;
  }
  static std::string problemOf(const std::string& name) {
    const auto now = status();
    for (const auto& source : now["sources"]) {
      if (source["name"].get<std::string>().find(name) != std::string::npos) return source["problem"];
    }
    throw std::invalid_argument{"there is no source " + name + " in " + now["sources"].dump()};
  }
  // Waits for it.
  static std::string problemComing(const std::string& name) {
    std::string problem;
    EXPECT_TRUE(eventually([&] { return !(problem = problemOf(name)).empty(); })) << name;
    return problem;
  }
  static bool isReady() {
    const auto now = status();
    if (now["clock"]["state"] != "locked") return false;
    if (!now["receiver"].is_null() && now["receiver"]["state"] != "locked") return false;
    return std::ranges::all_of(now["sources"], [](const auto& source) { return source["problem"] == ""; });
  }

  // The controller tells where its axes are only to a box that has not run anything yet.
  bool mayBegin() const { return isReady() && (!homes_ || areReferenced(axes())); }
  // None while the box does not answer.
  static nlohmann::json axes() {
    auto asked = command({"corrections"});
    return asked.status() == 0 ? nlohmann::json::parse(asked.out())["axes"] : nlohmann::json::array();
  }
  static bool areReferenced(const nlohmann::json& axes) {
    return axes.size() == 3 && std::ranges::all_of(axes, [](const auto& axis) { return axis["referenced"] == true; });
  }

  // Five touches for each of the speeds.
  static HostCommand calibrate(const std::string& speeds_mm_s = "20,40") {
    return command({"calibrate", "--speed", speeds_mm_s, "--accept", "--by", "somebody"});
  }
  // Ends the hold. Why the run asks for the touch that was held again; nothing when it counts.
  std::string whyAgain(const HostCommand& calibration) {
    const auto before = calibration.objects();
    const auto held = before.back()["step"];
    machine.hold(false);
    EXPECT_TRUE(eventually([&] { return calibration.objects().back().value("step", held) != held; }))
        << calibration.out() << calibration.err();
    const auto objects = calibration.objects();
    for (std::size_t i = before.size(); i < objects.size() && objects[i].value("step", held) == held; ++i) {
      const auto prompt = objects[i].value("prompt", "");
      const auto again = prompt.find("(again: ");
      if (again != std::string::npos) return prompt.substr(again);
    }
    return {};
  }

  // Unplugs what counts in a touch, which lasts until it is there again, and another one before is kept.
  void expectACalibrationEndsWithout(const std::string& source, const std::string& problem,
                                     const std::function<void()>& pull, const std::function<void()>& put) {
    auto calibration = calibrate();
    ASSERT_TRUE(eventually([&] { return machine.finishedSteps() > 1; }));
    const auto lost = lostSamples();
    ASSERT_TRUE(machine.holdInATouch());
    machine.between(pull);
    EXPECT_THAT(problemComing(source), testing::ContainsRegex(problem));
    machine.between(put);
    EXPECT_TRUE(eventually([] { return isReady(); })) << status().dump(1) << box.log();
    EXPECT_GT(lostSamples(), lost);
    machine.hold(false);
    EXPECT_NE(calibration.status(), 0) << calibration.out();
    EXPECT_THAT(calibration.err(), testing::HasSubstr(": an axis does not count from where it did when the run began"));
  }
  // Tells where it is as soon as it stands.
  void home(std::size_t axis) {
    const auto& real = machine.machine();
    EXPECT_TRUE(eventually([&] {
      const auto at_mm = real.positionAt(kernelNow())[axis];
      return real.speedAt(kernelNow()) == 0 &&
             command({"home", std::string{"XYZ"[axis]} + "=" + std::to_string(at_mm)}).status() == 0;
    }));
  }

  // A calibration that was accepted, to the delay that the machine really has.
  // late_s: of what the kernel stamps, at most.
  void expectTruth(HostCommand& calibration, double tau_s, double late_s) {
    ASSERT_EQ(calibration.status(), 0) << calibration.err() << status().dump(1) << box.log();
    nlohmann::json proposed;
    for (const auto& object : calibration.objects()) {
      if (object.contains("result")) proposed = object;
    }
    ASSERT_FALSE(proposed.is_null()) << calibration.out();
    const double found_s = proposed["result"]["tau_s"], sd_s = proposed["sd"]["tau_s"];
    std::printf("delay: %.1f us found, sd %.1f us, %.1f us true\n", 1e6 * found_s, 1e6 * sd_s, 1e6 * tau_s);
    EXPECT_LT(sd_s, 2e-5);
    EXPECT_NEAR(found_s, tau_s, 4 * sd_s + late_s);
    auto history = command({"history"});
    ASSERT_EQ(history.status(), 0) << history.err();
    EXPECT_NE(history.out().find("\"active\""), std::string::npos) << history.out();
  }

  static std::int64_t lostSamples() { return status()["ledger"]["lost_at_source_samples"]; }
  // Of a machine that has parked: no source came back with a step.
  static void expectPositionsOf(const world::Machine& machine) {
    nlohmann::json known;
    ASSERT_TRUE(eventually([&] { return areReferenced(known = axes()) && machine.speedAt(kernelNow()) == 0; }))
        << known.dump(1);
    const auto true_mm = machine.positionAt(kernelNow());
    for (std::size_t axis = 0; axis < known.size(); ++axis)
      EXPECT_NEAR(known[axis]["position_mm"].get<double>(), true_mm[axis], 0.01) << "axis " << axis;
  }

  bool homes_;
  BoxRights rights;
  BoxProcess box{MACHINE_BOARD};
  world::Config config = PlayedMachine::config();
  PlayedMachine machine;
};

}  // namespace probebox::vm
