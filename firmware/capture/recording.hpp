#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/events/event.hpp"
#include "protocol/units/scan_path.hpp"
#include "protocol/units/time.hpp"

namespace probebox::capture {

// Encoder counts of all linear axes at one stamp.
struct MachineRow {
  MonoTime at{};
  std::array<std::int64_t, kLinearAxes> counts{};
  // Screw expansion at this stamp (D1), nm; subtract it from the encoder position.
  std::array<std::int32_t, kLinearAxes> screw_nm{};
};

// One sample of the probe's channels.
struct ProbeRow {
  MonoTime at{};
  std::array<std::int32_t, 3> channels_nm{};
};

// One reading, nm, of the sensor at the end of the ball screw that is being turned.
struct DriftRow {
  MonoTime at{};
  std::int32_t reading_nm{};
};

// One angle of C by its encoder.
struct AngleRow {
  MonoTime at{};
  double c_rad{};
};

// C turns towards an angle until the ball touches the stylus, which stands still, and back.
struct TurnOfC {
  double line_rad{};     // C with the ball about on the nominal line
  double to_rad{};       // C must not turn beyond this angle, nor past the contact by more than the overtravel
  double speed_rad_s{};  // there and back
};

// Numbers that a method attaches to its steps and reads from the recording; no other code reads them.
using MethodNote = std::array<double, 3>;

// Device whose edges mark contact and release of a touch by edges.
enum class SwitchOf : std::uint8_t { tool_setter, probe };

// One step as the procedure asked for it: nominal outward normal, retract direction and speed, pose. All touches with
// the same `reading` are of one ball at one pose.
struct TouchRequest {
  std::uint32_t step{};
  std::array<double, 3> outward_normal{};
  std::array<double, 3> retract_direction{};
  double retract_speed_mm_s{};
  std::array<double, 3> rotary_angles_rad{};  // A B C; in a recording as reported, less whole turns from the wanted
  std::uint16_t ball{};                       // of the rotating part, from 1; 0 for another feature
  std::uint32_t reading{};                    // from 0
  std::uint32_t tool{};                       // in the spindle, by its number; 0: whichever carries the probe
  // Along the outward normal: travel of a jog without contact, or distance of a hold from the centre; 0 for a touch.
  double travel_mm{};
  bool sweeps{};           // the sensor of the screw of the axis along the normal is read, and no probe
  double rest_s{};         // with `sweeps`: the axis stands still for at least so long; 0: it turns its screw
  bool by_edges{};         // contact is detected by a switch, without samples of a probe
  bool holds{};            // stands still where a sensor head reads a ball, and touches nothing
  double head_range_mm{};  // range of its sensors, +- this value
  // Height of the contact above the centre of the stylus ball when the shank touches; 0 when the ball touches.
  double shank_height_mm{};
  std::uint16_t mount{};  // how the part is put on the table, from 1; 0: as it is
  MethodNote note{};
  SwitchOf switch_of{};  // for a touch by edges
  bool swivels{};        // B turns the probe, and not the part
  ScanPath scan{};       // of a scan, in contact between its markers; without arcs for another step
  std::optional<TurnOfC> until_contact{};
  std::uint8_t spindle{};  // 2: the second chuck turns the ball
};

// One recorded touch: the ranges of its rows, and the clock map for all of its stamps. Machine and probe share one map,
// so its error cancels in the delay.
struct Touch {
  TouchRequest request;
  TickMap map;
  std::size_t machine_begin{}, machine_end{};
  std::size_t probe_begin{}, probe_end{};
  std::size_t drift_begin{}, drift_end{};
  std::size_t angle_begin{}, angle_end{};
  // First contact and last release, for a touch measured by the edges of a device.
  std::optional<MonoTime> contact{}, release{};
};

struct Capacity {
  std::size_t machine_rows = 98'304;
  std::size_t probe_rows = 196'608;
  std::size_t drift_rows = 65'536;
  std::size_t angle_rows = 32'768;
  std::size_t touches = 256;
  std::size_t contacts = 8;
};

// Holds the rows of all touches of one run at native rates with their own stamps. Allocates in the constructor only.
class Recording {
 public:
  explicit Recording(Capacity capacity);

  void clear();
  // The system delay in force during the run; result_id 0 means none.
  void setDelay(const DelayActivated& delay) { delay_ = delay; }
  const DelayActivated& delay() const { return delay_; }
  // Machine positions at count 0, from the references at the start of the run; 0 for an axis without a reference.
  void setOffsets(const std::array<double, kLinearAxes>& offset_mm) { offset_mm_ = offset_mm; }
  const std::array<double, kLinearAxes>& offset_mm() const { return offset_mm_; }
  bool append(const MachineRow& row);  // returns false when full
  bool append(const ProbeRow& row);
  bool append(const DriftRow& row);
  bool append(const AngleRow& row);
  bool append(const Touch& touch);  // a contact by a turn of C is none of touches()
  // Removes the rows from the begin of this touch on.
  void truncate(const Touch& touch);
  // Keeps of the newest touch its positions and deflections within [from, until].
  void keepWithin(MonoTime from, MonoTime until, Touch& newest);

  std::size_t machineRowCount() const { return machine_rows_.size(); }
  std::size_t probeRowCount() const { return probe_rows_.size(); }
  std::size_t driftRowCount() const { return drift_rows_.size(); }
  std::size_t angleRowCount() const { return angle_rows_.size(); }
  std::span<const Touch> touches() const { return touches_; }
  std::span<const Touch> contacts() const { return contacts_; }  // by turns of C
  std::span<const MachineRow> machineRows(const Touch& touch) const;
  std::span<const ProbeRow> probeRows(const Touch& touch) const;
  std::span<const DriftRow> driftRows(const Touch& touch) const;
  std::span<const AngleRow> angleRows(const Touch& touch) const;

 private:
  // Filled up to the reserved capacity only, so push_back never allocates.
  std::vector<MachineRow> machine_rows_;
  std::vector<ProbeRow> probe_rows_;
  std::vector<DriftRow> drift_rows_;
  std::vector<AngleRow> angle_rows_;
  std::vector<Touch> touches_, contacts_;
  std::array<double, kLinearAxes> offset_mm_{};
  DelayActivated delay_{};
};

}  // namespace probebox::capture
