#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::capture {

// Reasons to reject a touch that are visible before solving. The solver checks the values again.
enum class TouchFault : std::uint8_t {
  none = 0,
  no_machine_rows,
  no_probe_rows,
  probe_clipped,  // ends the run
  source_lost,
  clock_not_locked,
  recording_full,
  wrong_pose,
  no_drift_rows,
  screw_unknown,
  no_edges,
  wrong_tool,
  head_out_of_range,
  moved,
  no_trigger,
  still_deflected,
  triggered_twice,
  rest_too_short,
  contact_lost,
  samples_missing,
  no_contact,
  wrong_side,
  no_angles,
  zero_lost,      // ends the run
  screw_changed,  // ends a run that has kept anything
};
const char* explain(TouchFault fault);

// A screw turns slowly, for minutes, and so does C until its ball touches: rows at this interval are enough for
// interpolation.
inline constexpr Nanoseconds kSweepInterval = std::chrono::milliseconds{10};

// A switch bounces for this time after the release; a later edge is of another contact.
inline constexpr Nanoseconds kBounce = std::chrono::milliseconds{20};

// Longest time between two edges of one chattering contact of a probe's switch.
inline constexpr Nanoseconds kChatter = std::chrono::milliseconds{5};

// A hole in the samples of a scan that may hide a step of its path.
inline constexpr Nanoseconds kHole = std::chrono::milliseconds{10};

// Position tolerance of a machine at standstill: servo and encoder noise together.
inline constexpr double kStill_mm = 0.02;

// Collects the rows of consecutive touches, each between its begin and end markers; of a touch it keeps those near the
// contact.
class TouchCapture {
 public:
  // mm_per_count: linear axes; a hold uses it to detect motion.
  explicit TouchCapture(Capacity capacity, const std::array<double, kLinearAxes>& mm_per_count = {})
      : recording_{capacity}, mm_per_count_{mm_per_count} {}

  // Clears the recording for a new run. delay: in force during the run (result_id 0: none). offset_mm: references of
  // the axes.
  void clear(const DelayActivated& delay, const std::array<double, kLinearAxes>& offset_mm);
  // For a run that has kept nothing yet.
  void setOffsets(const std::array<double, kLinearAxes>& offset_mm) { recording_.setOffsets(offset_mm); }
  void begin(const TouchRequest& request);
  // screw_nm: see MachineRow, for the axis of `count`; nullopt when the expansion of its screw is unknown.
  void push(const Count& count, std::optional<std::int32_t> screw_nm = 0);
  void push(const Deflection& deflection);
  void push(const Drift& drift);
  void push(const SourceLost& lost);
  void push(const AngleRow& angle);
  // Edges of the tool-setting device, or of the switch of the probe. When they bounce, the first edge is the contact;
  // the release is the last edge of the device. Of the probe's switch it is the first closing after the chatter of the
  // contact (kChatter). What follows later than the bounces of a release (kBounce) is a second contact, and a fault.
  void push(const Edge& edge, SwitchOf of = SwitchOf::tool_setter);
  TouchFault end(const TickMap& map);  // keeps the touch only if it returns no fault
  void abandon();

  bool running() const { return running_; }
  const Recording& recording() const { return recording_; }
  // Counts without counts of the other axes at the same stamp.
  std::uint64_t incompleteRows() const { return incomplete_rows_; }

 private:
  void takeProbeEdge(const Edge& edge);
  void takeDeviceEdge(const Edge& edge);
  void note(TouchFault fault);
  bool needs(Source source) const;
  bool stoodStill() const;
  bool restedLongEnough() const;
  bool hasHole() const;
  bool isDue(MonoTime at, MonoTime& kept) const;
  TouchFault edgeFault() const;
  void keepTouch();

  Recording recording_;
  std::array<double, kLinearAxes> mm_per_count_;
  Touch touch_;
  bool running_{};
  TouchFault fault_{};
  std::array<Level, 2> level_{Level::inactive, Level::inactive};  // of each switch, after its newest edge
  MonoTime chatter_end_{};                                        // of the probe's switch, after the contact
  MachineRow row_;
  MonoTime row_kept_{}, probe_row_kept_{}, angle_kept_{};  // the last ones of what is recorded at kSweepInterval
  std::uint8_t axes_in_row_{};
  std::uint64_t incomplete_rows_{};
};

}  // namespace probebox::capture
