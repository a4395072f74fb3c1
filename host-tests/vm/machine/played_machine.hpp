#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "drivers/world/controller.hpp"
#include "drivers/world/machine.hpp"
#include "firmware/app/wiring/controller_link.hpp"
#include "gpio_sim.hpp"

namespace probebox::vm {

// Sensors of the machine as devices of the kernel. Called by the machine's thread at every tick, with the machine
// standing where it is `now`.
class PlayedSensors {
 public:
  virtual ~PlayedSensors() = default;
  virtual void play(const world::Machine& machine) = 0;
};

// How encoders are wired to the box's inputs.
struct Wiring {
  std::array<std::size_t, 3> axis_at_input{0, 1, 2};
  std::array<int, 3> sense{1, -1, 1};  // of the counts at each input; A and B exchanged turn it
  bool index{true};
};

// What sensors show of a machine: late by delays that the box does not know, and with noise.
class Truth {
 public:
  static constexpr double kCountsPerMm = 100'000;
  static constexpr double kMark_mm = 125;  // of X

  explicit Truth(const world::Config& config);

  std::int64_t counts(const world::Machine& machine, std::size_t axis, MonoTime at);
  // nm at unit gain, channels a, b, c.
  std::array<std::int32_t, 3> channels(const world::Machine& machine, MonoTime at);
  double tau_s() const { return config_.delays.tau_machine_s[0] - config_.delays.tau_probe_s; }

 private:
  world::Config config_;
  world::Matrix3 channels_of_displacement_;
  std::mt19937_64 random_{7};
  std::normal_distribution<double> normal_;
};

// The emulated machine and its controller in real time, whose sync line is a line of gpio-sim. The controller speaks to
// the box over TCP, as any controller does.
class PlayedMachine {
 public:
  static world::Config config();

  // homes: the controller tells where its axes are after a start.
  PlayedMachine(const world::Config& config, const std::string& box, bool homes);
  ~PlayedMachine() { stop(); }
  PlayedMachine(const PlayedMachine&) = delete;
  PlayedMachine& operator=(const PlayedMachine&) = delete;

  const world::Machine& machine() const { return machine_; }
  void start(PlayedSensors& sensors);
  void stop();
  // Between two ticks, such as to pull a plug.
  void between(const std::function<void()>& action);
  // The operator's feed hold: the controller does nothing more, and the machine ends the move that it makes.
  void hold(bool held);
  // Holds the feed as soon as a touch is being recorded: that touch lasts until the hold ends. False when none came.
  bool holdInATouch();
  // The sync line's chip goes away and comes back.
  void unplugSync();
  void plugInSync();
  std::uint64_t finishedSteps();

 private:
  void run(PlayedSensors& sensors);

  GpioSim chip_{"probebox-vm", {""}};
  bool has_sync_{true};
  bool is_held_{};
  app::ControllerLink link_;
  world::Machine machine_;
  world::Controller controller_;
  std::mutex mutex_;
  std::atomic<bool> stopping_{};
  std::thread thread_;
};

MonoTime kernelNow();

}  // namespace probebox::vm
