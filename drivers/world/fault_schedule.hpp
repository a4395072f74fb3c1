#pragma once
#include <array>
#include <cmath>
#include <cstddef>

#include "drivers/world/config.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Describes a fault that begins at `at` and lasts for `duration`.
struct Fault {
  FaultKind kind{};
  MonoTime at{};
  Nanoseconds duration{};
  Nanoseconds jump{};
};

// Places a fault of world.toml, whose time counts from `start`.
inline Fault faultFrom(MonoTime start, const board::WorldFault& described) {
  const auto seconds = [](double s) { return Nanoseconds{std::llround(1e9 * s)}; };
  return {.kind = described.kind,
          .at = start + seconds(described.at_s),
          .duration = seconds(described.lasts_s),
          .jump = seconds(described.jump_s)};
}

// Schedules the faults of a run. Does not allocate.
class FaultSchedule {
 public:
  static constexpr std::size_t kMostFaults = 64;

  bool add(const Fault& fault) {
    if (count_ == kMostFaults) return false;
    faults_[count_++] = fault;
    return true;
  }

  bool active(FaultKind kind, MonoTime at) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const Fault& fault = faults_[i];
      if (fault.kind == kind && at >= fault.at && at - fault.at < fault.duration) return true;
    }
    return false;
  }

  // Returns the next jump of the clock that is due, each once.
  const Fault* takeJump(MonoTime at) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (faults_[i].kind != FaultKind::clock_jumps || jumped_[i] || at < faults_[i].at) continue;
      jumped_[i] = true;
      return &faults_[i];
    }
    return nullptr;
  }

 private:
  std::array<Fault, kMostFaults> faults_{};
  std::array<bool, kMostFaults> jumped_{};
  std::size_t count_{};
};

}  // namespace probebox::world
