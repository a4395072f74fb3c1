#pragma once
#include <cstdint>
#include <optional>

#include "firmware/corrections/held_source.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::corrections {

using published::SensorFault;

// The screw of one linear axis and the sensor at its free end, as described in machine.toml.
struct ScrewConfig {
  bool fitted{};
  metrology::ScrewModel model;  // its gain is the negative of (D2): it gives the correction to add
  metrology::ScrewLimits limits;
  double angle_zero_mm{};                      // where sector 0 begins
  Nanoseconds stale{std::chrono::seconds{1}};  // age at which a reading expires
  Nanoseconds hold{std::chrono::seconds{5}};   // T_hold
};

// Computes the correction of one axis from the extension of its screw at every tick (CN101394969, (D1) to (D6)).
class ScrewSource {
 public:
  ScrewSource(const ScrewConfig& config, std::size_t axis);

  void push(const Drift& drift);
  void sensorLost() { fault_ = SensorFault::lost, reading_um_.reset(); }
  // Gain and face table; the reference stays.
  void push(const ScrewActivated& activated);
  // The reference; gain and face table stay.
  void push(const ScrewReferenceActivated& activated);
  void tick(const MachineTick& tick);

  static constexpr auto kKind = SourceKind::screw;
  const HeldSource& held() const { return held_; }
  bool fitted() const { return config_.fitted; }
  SourceInputs inputs() const;
  SensorFault fault() const { return fault_; }
  bool sensorGood() const { return config_.fitted && fault_ == SensorFault::none && reading_um_.has_value(); }
  // Last valid extension without the face run-out, um; 0 before the first.
  double extension_um() const { return extension_um_; }
  // Reading of its sensor when the screw is cold.
  double reference_um() const { return model_.reference_um; }
  // How often another result about it came into force, or none.
  std::uint32_t results() const { return results_; }
  // Tests whether that extension is at most T_hold old. False for a screw without a sensor.
  bool extensionKnown(MonoTime now) const;
  // The correction as a line over the axis position, for controllers that compensate by position: value at 0 mm, and
  // change per mm.
  double offset_mm() const;
  double slope() const;

 private:
  std::optional<double> freshReading(MonoTime now);

  ScrewConfig config_;
  std::size_t axis_;
  metrology::ScrewModel model_;  // the model in force
  metrology::ScrewCompensator compensator_;
  HeldSource held_;
  std::optional<double> reading_um_;
  double extension_um_{};
  std::optional<MonoTime> believed_at_;
  std::optional<MonoTime> stepped_at_;  // when the compensator last had a position and a reading
  MonoTime reading_at_{};
  SensorFault fault_{};
  std::uint32_t results_{};
};

}  // namespace probebox::corrections
