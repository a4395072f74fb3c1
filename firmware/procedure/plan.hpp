#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "firmware/capture/recording.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Numbers of the methods in events and registers: add at the end, never change.
enum class Method : std::uint16_t { none = 0, delay_multi_speed = 1 };

std::string_view nameOf(Method method);
std::optional<Method> methodNamed(std::string_view name);
// The names of the methods that a box can run, for messages to a person.
std::span<const std::string_view> methodNames();

// One step that the machine is asked to do: drive onto the surface along the inward normal to the overtravel, dwell,
// and retract at constant speed until the clearance.
struct Step {
  capture::TouchRequest touch;
  double overtravel_mm{};
  double clearance_mm{};
};

inline constexpr std::size_t kMostSteps = 128;

struct Plan {
  Method method{};
  std::size_t step_count{};
  std::array<Step, kMostSteps> steps{};
};

struct MultiSpeedOptions {
  static constexpr std::size_t kMostSpeeds = kMostSteps / 5;
  std::array<double, kMostSpeeds> speeds_mm_s{5, 10, 20, 30, 40};
  std::size_t speed_count = 5;
  double overtravel_mm = 0.5;
  double clearance_mm = 0.6;
};

// Five touches of a datum sphere (+x -x +y -y +z) at each speed. CN101622513 (system delay), docs/metrology.md A.5.
Plan planMultiSpeed(const MultiSpeedOptions& options);

// What a person or a controller is to do, in one sentence.
std::string promptFor(const Plan& plan, std::size_t step);

}  // namespace probebox::procedure
