#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::capture {

// One latch of all linear axes at one stamp.
struct MachineRow {
  MonoTime at{};
  std::array<std::int64_t, kLinearAxes> counts{};
  // What a warm screw asked to be added at that time (D1): the tool stood by so much below where the counts say.
  std::array<std::int32_t, kLinearAxes> screw_nm{};
};

// One sample of the probe's channels.
struct ProbeRow {
  MonoTime at{};
  std::array<std::int32_t, 3> channels_nm{};
};

// One reading of the sensor at the end of the ball screw that is being turned.
struct DriftRow {
  MonoTime at{};
  std::int32_t reading_nm{};
};

// A step of centreline-by-steps. Angles clockwise.
struct RimStep {
  std::uint16_t loop{};  // from 1; 0: before the first
  double zero_rad{};     // of C in this loop, from where it was in the first
  double c_rad{};        // from that zero
};

// What the procedure had asked for: nominal outward normal of the surface, direction of the retract, its speed, and the
// pose of the machine. The touches of one reading belong to one place of one ball.
struct TouchRequest {
  std::uint32_t step{};
  std::array<double, 3> outward_normal{};
  std::array<double, 3> retract_direction{};
  double retract_speed_mm_s{};
  std::array<double, 3> rotary_angles_rad{};  // A B C; in a recording as the machine said that it stood
  std::uint16_t ball{};                       // of the rotating part, from 1; 0 for another feature
  std::uint32_t reading{};                    // from 0
  std::uint32_t tool{};                       // in the spindle, by its number; 0: whichever carries the probe
  // Along the outward normal: of a jog that touches nothing, and of where to hold, from the middle; 0: a touch.
  double travel_mm{};
  bool sweeps{};           // turns the screw of the axis along the normal: its sensor is read, and no probe
  bool by_edges{};         // the tool-setting device tells the contact, and no probe
  bool holds{};            // stands still where a sensor head reads a ball, and touches nothing
  double head_range_mm{};  // of its sensors, to either side
  // The shank touches, so far above the middle of the stylus' ball; 0: the ball does.
  double shank_height_mm{};
  RimStep rim{};
};

// One recorded touch: where its rows lie, and the clock that turns all of its stamps into master time. One map for the
// whole touch: machine and probe share its error, which then cancels in the delay.
struct Touch {
  TouchRequest request;
  TickMap map;
  std::size_t machine_begin{}, machine_end{};
  std::size_t probe_begin{}, probe_end{};
  std::size_t drift_begin{}, drift_end{};
  // When the device was touched first and let go last, of a touch by edges.
  std::optional<MonoTime> contact{}, release{};
};

struct Capacity {
  std::size_t machine_rows = 98'304;
  std::size_t probe_rows = 196'608;
  std::size_t drift_rows = 65'536;
  std::size_t touches = 256;
};

// The rows of all touches of one run, at native rates and with their own stamps. All memory is taken at construction.
class Recording {
 public:
  explicit Recording(Capacity capacity);

  void clear();
  // The system delay that is in force while the run is recorded; result_id 0 for none.
  void setDelay(const DelayActivated& delay) { delay_ = delay; }
  const DelayActivated& delay() const { return delay_; }
  // Machine position where the counts are 0, by the references as the run began; 0 for an axis without one.
  void setOffsets(const std::array<double, kLinearAxes>& offset_mm) { offset_mm_ = offset_mm; }
  const std::array<double, kLinearAxes>& offset_mm() const { return offset_mm_; }
  bool append(const MachineRow& row);  // false: full
  bool append(const ProbeRow& row);
  bool append(const DriftRow& row);
  bool append(const Touch& touch);
  // Back to where the rows of this touch begin.
  void truncate(const Touch& touch);

  std::size_t machineRowCount() const { return machine_rows_.size(); }
  std::size_t probeRowCount() const { return probe_rows_.size(); }
  std::size_t driftRowCount() const { return drift_rows_.size(); }
  std::span<const Touch> touches() const { return touches_; }
  std::span<const MachineRow> machineRows(const Touch& touch) const;
  std::span<const ProbeRow> probeRows(const Touch& touch) const;
  std::span<const DriftRow> driftRows(const Touch& touch) const;

 private:
  // Filled up to the reserved capacity only, so that push_back never allocates.
  std::vector<MachineRow> machine_rows_;
  std::vector<ProbeRow> probe_rows_;
  std::vector<DriftRow> drift_rows_;
  std::vector<Touch> touches_;
  std::array<double, kLinearAxes> offset_mm_{};
  DelayActivated delay_{};
};

}  // namespace probebox::capture
