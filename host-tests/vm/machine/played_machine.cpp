#include "played_machine.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <pthread.h>
#include <sched.h>
#include <stdexcept>
#include <sys/mman.h>

#include "board/describe/parse.hpp"
#include "drivers/tcp/address.hpp"

namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

using world::operator*;

constexpr unsigned kSync = 0;

const board::Descriptions& emulated() {
  static const auto descriptions = board::simDescriptions();
  return *descriptions;
}

tcp::Address addressOf(const std::string& box) {
  const auto address = tcp::parseAddress(box);
  if (!address) throw std::runtime_error{address.error().what};
  return *address;
}

world::ControllerConfig controllerThat(bool homes) {
  auto config = world::controllerFor(*emulated().world);
  config.homes = homes;
  return config;
}

}  // namespace

MonoTime kernelNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

Truth::Truth(const world::Config& config)
    : config_{config}, channels_of_displacement_{world::inverse(config.probe.gain)} {}

std::int64_t Truth::counts(const world::Machine& machine, std::size_t axis, MonoTime at) {
  const double position_mm = machine.positionAt(at, config_.delays.tau_machine_s[axis])[axis] +
                             config_.encoders.power_up_mm[axis] + 1e-3 * config_.encoders.noise_um * normal_(random_);
  return std::llround(position_mm * kCountsPerMm);
}

std::array<std::int32_t, 3> Truth::channels(const world::Machine& machine, MonoTime at) {
  const auto shown_mm = channels_of_displacement_ * machine.probeDisplacementAt(at, config_.delays.tau_probe_s);
  std::array<std::int32_t, 3> channels{};
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const double noisy_mm = shown_mm[i] + 1e-3 * config_.probe.noise_um * normal_(random_);
    channels[i] = static_cast<std::int32_t>(std::lround(1e6 * std::clamp(noisy_mm, -1.2, 1.2)));
  }
  return channels;
}

world::Config PlayedMachine::config() {
  world::Config config{*emulated().world, emulated().machine};
  config.start = kernelNow();
  config.screws = {};
  return config;
}

PlayedMachine::PlayedMachine(const world::Config& config, const std::string& box, bool homes)
    : link_{addressOf(box)}, machine_{config, 1}, controller_{controllerThat(homes), machine_, link_} {}

void PlayedMachine::start(PlayedSensors& sensors) {
  thread_ = std::thread{[this, &sensors] { run(sensors); }};
}

void PlayedMachine::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void PlayedMachine::between(const std::function<void()>& action) {
  const std::lock_guard lock{mutex_};
  action();
}

void PlayedMachine::hold(bool held) {
  between([&] { is_held_ = held; });
}

bool PlayedMachine::holdInATouch() {
  for (int tries = 0; tries < 60'000; ++tries, std::this_thread::sleep_for(1ms)) {
    const std::lock_guard lock{mutex_};
    const auto activity = controller_.activity();
    is_held_ = activity == world::Activity::approaching || activity == world::Activity::dwelling;
    if (is_held_) return true;
  }
  return false;
}

void PlayedMachine::unplugSync() {
  between([this] { has_sync_ = false; });
  std::this_thread::sleep_for(300ms);  // what the kernel holds goes with the chip: the box has read it by now
  chip_.unplug();
}

void PlayedMachine::plugInSync() {
  chip_.plugIn();
  std::this_thread::sleep_for(1500ms);  // the box asks for its lines every second
  between([this] { has_sync_ = true; });
}

std::uint64_t PlayedMachine::finishedSteps() {
  const std::lock_guard lock{mutex_};
  return controller_.finishedSteps();
}

void PlayedMachine::run(PlayedSensors& sensors) {
  // A page of a program comes from this computer's files, and may seem to take seconds.
  mlockall(MCL_CURRENT | MCL_FUTURE);
  // On time whatever the box does, but below the kernel's interrupt threads (50).
  const sched_param priority{.sched_priority = 10};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  auto due = std::chrono::steady_clock::now();
  while (!stopping_) {
    {
      const std::lock_guard lock{mutex_};
      if (has_sync_) chip_.pulse(kSync);
      if (!is_held_) controller_.advance(kernelNow());
      sensors.play(machine_);
    }
    due += 1ms;
    std::this_thread::sleep_until(due);
  }
}

}  // namespace probebox::vm
