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
  Nanoseconds stale{std::chrono::milliseconds{250}};  // an angle that is older is in doubt; zero: none ever is
};

// How a rotary axis stands: by the counts of its encoder, which need a reference, or by what the controller says.
class RotaryAngle {
 public:
  explicit RotaryAngle(const RotaryAngleConfig& config) : config_{config}, reference_{config.reference} {}

  void push(const AngleCount& count);
  // The controller's word: the angle itself, or what an incremental encoder is referenced by. False when that cannot
  // be: the axis has not been seen to stand still.
  bool told(double angle_rad, MonoTime at);
  void encoderLost() { reference_.encoderLost(); }

  AngleNow at(MonoTime now) const;
  bool described() const { return config_.described; }
  // Of an encoder that lacks its reference there is no angle.
  bool known() const;
  const AxisReference& reference() const { return reference_; }

 private:
  RotaryAngleConfig config_;
  AxisReference reference_;
  std::optional<double> told_rad_;
  MonoTime heard_at_{};
};

}  // namespace probebox::corrections
