#pragma once
#include <cstdint>
#include <optional>

#include "firmware/corrections/held_source.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/published/snapshot.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

using published::SensorFault;

// The screw of one linear axis and the sensor at its free end, as machine.toml describes them.
struct ScrewConfig {
  bool fitted{};
  metrology::ScrewModel model;  // its gain gives the correction that is added, so it is the negative of (D2)
  metrology::ScrewLimits limits;
  double pitch_mm{10};                         // of the thread: a turn of the screw moves the nut this far
  double angle_zero_mm{};                      // where sector 0 begins
  Nanoseconds stale{std::chrono::seconds{1}};  // a reading that is older is no reading
  Nanoseconds hold{std::chrono::seconds{5}};   // T_hold
};

// Extension of one screw to the correction of its axis, at every tick (CN101394969, (D1) to (D6)).
class ScrewSource {
 public:
  ScrewSource(const ScrewConfig& config, std::size_t axis);

  void push(const Drift& drift);
  void sensorLost() { fault_ = SensorFault::lost, reading_um_.reset(); }
  void push(const ScrewActivated& activated);
  void tick(const MachineTick& tick);
  void doubtful(MonoTime now) {
    if (config_.fitted) held_.doubtful(now);
  }

  const HeldSource& held() const { return held_; }
  bool fitted() const { return config_.fitted; }
  SensorFault fault() const { return fault_; }
  bool sensorGood() const { return config_.fitted && fault_ == SensorFault::none && reading_um_.has_value(); }
  // The last one that was believed, what the face of the screw added taken out; 0 before.
  double extension_um() const { return extension_um_; }
  // Whether that is at most T_hold old. A screw without a sensor has none that anybody could ask for.
  bool extensionKnown(MonoTime now) const;
  // The correction as a line over the axis position, for controllers that compensate by position: at 0 mm, and per mm.
  double offset_mm() const;
  double slope() const;

 private:
  std::optional<double> freshReading(MonoTime now);

  ScrewConfig config_;
  std::size_t axis_;
  metrology::ScrewModel model_;  // in force
  metrology::ScrewCompensator compensator_;
  HeldSource held_;
  std::optional<double> reading_um_;
  double extension_um_{};
  std::optional<MonoTime> believed_at_;
  MonoTime reading_at_{};
  SensorFault fault_{};
};

}  // namespace probebox::corrections
