#pragma once
#include <optional>

#include "firmware/corrections/axis_reference.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

enum class AngleFrom : std::uint8_t { encoder, controller };

// One rotary axis, as machine.toml describes it.
struct RotaryAngleConfig {
  bool described{};
  AngleFrom from{AngleFrom::encoder};
  ReferenceConfig reference{};                        // of the encoder, in degrees where it says mm
  bool wraps{};                                       // its counts may go on from 360 to 0 degrees
  Nanoseconds stale{std::chrono::milliseconds{250}};  // age at which an angle is in doubt; zero: never
};

// Angle of one rotary axis: from encoder counts, which need a reference, or from the controller.
class RotaryAngle {
 public:
  explicit RotaryAngle(const RotaryAngleConfig& config) : config_{config}, reference_{config.reference} {}

  void push(const AngleCount& count);
  // Takes an angle from the controller, or the reference of an incremental encoder. Returns false when the axis is not
  // at standstill, or its encoder is silent.
  bool told(double angle_rad, MonoTime at);
  void encoderLost(bool is_gone);

  AngleNow at(MonoTime now) const;
  // Angle of the last latch; nullopt without an encoder or its reference.
  std::optional<double> latched_rad() const;
  bool described() const { return config_.described; }
  // False for an encoder without a reference.
  bool known() const;
  const AxisReference& reference() const { return reference_; }

 private:
  std::int64_t unwrapped(const AngleCount& count);

  RotaryAngleConfig config_;
  AxisReference reference_;
  std::optional<AngleCount> before_;
  int turns_{};  // that its counts have left out
  std::optional<double> told_rad_;
  MonoTime heard_at_{};
};

}  // namespace probebox::corrections
