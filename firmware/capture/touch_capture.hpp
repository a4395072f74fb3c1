#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::capture {

// Why a touch cannot be used, as far as that shows before solving. The solver looks again, at the values.
enum class TouchFault : std::uint8_t {
  none = 0,
  no_machine_rows,
  no_probe_rows,
  probe_clipped,
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
};
const char* explain(TouchFault fault);

// A screw turns slowly, for minutes: so many positions are enough to interpolate between.
inline constexpr Nanoseconds kSweepInterval = std::chrono::milliseconds{10};

// A machine that stands still stays within this, its servo and its encoders taken together.
inline constexpr double kStill_mm = 0.02;

// Collects the rows of one touch after the other, between the markers of its begin and its end.
class TouchCapture {
 public:
  // mm_per_count: of the linear axes, by which a hold sees whether they stand still.
  explicit TouchCapture(Capacity capacity, const std::array<double, kLinearAxes>& mm_per_count = {})
      : recording_{capacity}, mm_per_count_{mm_per_count} {}

  // Empties the recording for a run during which this delay is in force (result_id 0 for none), and the axes are
  // referenced like this.
  void clear(const DelayActivated& delay, const std::array<double, kLinearAxes>& offset_mm);
  void begin(const TouchRequest& request);
  // screw_nm: as in MachineRow, of the axis of the count; nothing where the extension of its screw is not known.
  void push(const Count& count, std::optional<std::int32_t> screw_nm = 0);
  void push(const Deflection& deflection);
  void push(const Drift& drift);
  void push(const SourceLost& lost);
  // Of the tool-setting device. Where it chatters, the first edge is the contact and the last one the release.
  void push(const Edge& edge);
  TouchFault end(const TickMap& map);  // keeps the touch only when there is no fault
  void abandon();

  bool running() const { return running_; }
  const Recording& recording() const { return recording_; }
  // Latches that could not be joined to a row because another axis was not latched at the same stamp.
  std::uint64_t incompleteRows() const { return incomplete_rows_; }

 private:
  void note(TouchFault fault);
  bool needs(Source source) const;
  bool stoodStill() const;

  Recording recording_;
  std::array<double, kLinearAxes> mm_per_count_;
  Touch touch_;
  bool running_{};
  TouchFault fault_{};
  MachineRow row_;
  MonoTime row_kept_{};  // the last one of a sweep
  std::uint8_t axes_in_row_{};
  std::uint64_t incomplete_rows_{};
};

}  // namespace probebox::capture
