#include "firmware/capture/touch_capture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/capture/near_contact.hpp"
#include "firmware/capture/turn_until_contact.hpp"

namespace probebox::capture {
namespace {

constexpr std::size_t kFewestRows = 5;
constexpr std::uint8_t kAllAxes = (1U << kLinearAxes) - 1U;

bool atTheEnd(const Deflection& deflection, double range_mm) {
  return std::ranges::any_of(deflection.channels_nm,
                             [&](std::int32_t channel) { return std::abs(1e-6 * channel) >= range_mm; });
}

// In a slow stream a hole is a gap of more than three intervals.
bool hasHoleIn(const auto& rows) {
  const Nanoseconds interval = (rows.back().at - rows.front().at) / static_cast<std::int64_t>(rows.size() - 1);
  const Nanoseconds hole = std::max(kHole, 3 * interval);
  return std::ranges::adjacent_find(
             rows, [&](const auto& before, const auto& after) { return after.at - before.at > hole; }) != rows.end();
}

TouchFault faultOf(TurnLacks lack) {
  switch (lack) {
    case TurnLacks::nothing:
      return TouchFault::none;
    case TurnLacks::contact:
      return TouchFault::no_contact;
    case TurnLacks::release:
      return TouchFault::no_trigger;
    case TurnLacks::angles:
      return TouchFault::no_angles;
    case TurnLacks::side:
      return TouchFault::wrong_side;
  }
  return TouchFault::none;
}

}  // namespace

const char* explain(TouchFault fault) {
  switch (fault) {
    case TouchFault::none:
      return "";
    case TouchFault::no_machine_rows:
      return "no encoder positions arrived: check the encoder inputs";
    case TouchFault::no_probe_rows:
      return "no deflections arrived: check the probe's cable and receiver";
    case TouchFault::probe_clipped:
      return "the probe reached the end of its range, and the step is not repeated because it would press as deep "
             "again: "
             "check where the control takes the feature to be, let it move until its skip input and on from there, or "
             "touch with less overtravel";
    case TouchFault::source_lost:
      return "a source was lost during the touch: see the loss counters in status";
    case TouchFault::clock_not_locked:
      return "the master clock was not locked: check the sync line";
    case TouchFault::recording_full:
      return "the recording is full: choose fewer or faster touches";
    case TouchFault::wrong_pose:
      return "the rotary axes are not at the angles that the step needs: turn them as the prompt says, and give their "
             "angles in the marker";
    case TouchFault::wrong_tool:
      return "the step needs another tool in the spindle: change it as the prompt says, and give its number in the "
             "marker";
    case TouchFault::head_out_of_range:
      return "a sensor of the head is at the end of its range: move the ball closer to the centre of the head";
    case TouchFault::moved:
      return "the machine moved during a standstill measurement: begin the step when it has stopped, and end it before "
             "it moves on";
    case TouchFault::no_drift_rows:
      return "no readings of the screw's sensor arrived: check its cable, and [devices] drift in box.toml";
    case TouchFault::screw_unknown:
      return "the sensor of a warm screw delivers no readings, so the tool position is unknown: repair it (`probebox "
             "corrections` names it), or remove its [screw] from machine.toml";
    case TouchFault::no_edges:
      return "the tool-setting device gave no edge at contact and at release: check its cable, and [tool_setter] "
             "trigger in machine.toml";
    case TouchFault::no_trigger:
      return "the probe's switch gave no edge at contact and at release: check that the probe is switched on, its "
             "cable, and [probe] trigger in probe.toml";
    case TouchFault::still_deflected:
      return "the probe's switch was open before the touch began: move off the surface until the stylus is seated, and "
             "check that the probe re-arms";
    case TouchFault::triggered_twice:
      return "the probe's switch, or the tool-setting device, tripped twice in one touch: touch once, without "
             "vibration, and come off the surface by the clearance";
    case TouchFault::rest_too_short:
      return "the readings of the screw's sensor cover less time than the step needs: stand still for all of it before "
             "the end marker";
    case TouchFault::contact_lost:
      return "the probe came off the surface during the scan: check the size of the sphere and where the control takes "
             "its middle to be, or scan deeper (--overtravel)";
    case TouchFault::samples_missing:
      return "samples were missing for 10 ms and more during the scan: see the loss counters in status";
    case TouchFault::no_contact:
      return "C turned and nothing touched the stylus: check that the stylus stands at the height of the ball, at the "
             "distance from the nominal line that the step states, that the ball is on the side that C turns from, and "
             "c_deg and beside_mm of [rim_ball] in machine.toml";
    case TouchFault::wrong_side:
      return "the ball touched the stylus from the wrong side: take the angle of C that the step states first, and "
             "turn C from there in the direction that it states";
    case TouchFault::no_angles:
      return "no angles of C arrived around the contact: check the encoder of C, and that it is referenced (`probebox "
             "status`)";
    case TouchFault::zero_lost:
      return "an axis does not count from where it did when the run began, because its encoder was lost or miscounted, "
             "or it was homed anew: positions before and after do not go together. See `probebox corrections`, home "
             "the axis, and start the run again";
    case TouchFault::screw_changed:
      return "another result about a ball screw came into force since the run began, and the positions before and "
             "after do not go together: measure again, and accept or roll back such results between runs";
  }
  return "";
}

void TouchCapture::clear(const DelayActivated& delay, const std::array<double, kLinearAxes>& offset_mm) {
  recording_.clear();
  recording_.setOffsets(offset_mm);
  recording_.setDelay(delay);
  running_ = false;
}

void TouchCapture::begin(const TouchRequest& request) {
  if (running_) abandon();
  touch_ = Touch{.request = request,
                 .map = {},
                 .machine_begin = recording_.machineRowCount(),
                 .machine_end = 0,
                 .probe_begin = recording_.probeRowCount(),
                 .probe_end = 0,
                 .drift_begin = recording_.driftRowCount(),
                 .drift_end = 0,
                 .angle_begin = recording_.angleRowCount(),
                 .angle_end = 0};
  row_kept_ = probe_row_kept_ = angle_kept_ = MonoTime::min();
  fault_ = TouchFault::none;
  const bool of_probe = request.by_edges && request.switch_of == SwitchOf::probe;
  if (of_probe && level_[static_cast<std::size_t>(SwitchOf::probe)] == Level::active) note(TouchFault::still_deflected);
  axes_in_row_ = 0;
  running_ = true;
}

void TouchCapture::push(const Count& count, std::optional<std::int32_t> screw_nm) {
  if (!running_) return;
  if (!screw_nm && !touch_.request.sweeps) note(TouchFault::screw_unknown);
  if (axes_in_row_ != 0 && count.at != row_.at) {
    ++incomplete_rows_;
    axes_in_row_ = 0;
  }
  const auto axis = static_cast<std::size_t>(count.axis);
  row_.at = count.at;
  row_.counts[axis] = count.counts;
  row_.screw_nm[axis] = screw_nm.value_or(0);
  axes_in_row_ |= static_cast<std::uint8_t>(1U << axis);
  if (axes_in_row_ != kAllAxes) return;
  axes_in_row_ = 0;
  if (!isDue(row_.at, row_kept_)) return;
  if (!recording_.append(row_)) note(TouchFault::recording_full);
}

void TouchCapture::push(const Deflection& deflection) {
  if (!running_ || !needs(Source::probe)) return;
  const auto& request = touch_.request;
  if (deflection.clipped) note(request.holds ? TouchFault::head_out_of_range : TouchFault::probe_clipped);
  if (request.holds && atTheEnd(deflection, request.head_range_mm)) note(TouchFault::head_out_of_range);
  if (request.scan.count > 0 && !isInContact(deflection.channels_nm)) note(TouchFault::contact_lost);
  if (!isDue(deflection.at, probe_row_kept_)) return;
  if (!recording_.append(ProbeRow{deflection.at, deflection.channels_nm})) note(TouchFault::recording_full);
}

void TouchCapture::push(const Drift& drift) {
  const auto& request = touch_.request;
  if (!running_ || !request.sweeps || request.outward_normal[static_cast<std::size_t>(drift.axis)] == 0) return;
  if (!recording_.append(DriftRow{drift.at, drift.reading_nm})) note(TouchFault::recording_full);
}

void TouchCapture::push(const AngleRow& angle) {
  if (!running_ || !touch_.request.until_contact || !isDue(angle.at, angle_kept_)) return;
  if (!recording_.append(angle)) note(TouchFault::recording_full);
}

// Slow steps keep a row now and then.
bool TouchCapture::isDue(MonoTime at, MonoTime& kept) const {
  if (!touch_.request.sweeps && !touch_.request.until_contact) return true;
  if (kept != MonoTime::min() && at - kept < kSweepInterval) return false;
  kept = at;
  return true;
}

void TouchCapture::push(const SourceLost& lost) {
  if (running_ && needs(lost.source)) note(TouchFault::source_lost);
}

void TouchCapture::push(const Edge& edge, SwitchOf of) {
  const Level before = std::exchange(level_[static_cast<std::size_t>(of)], edge.level);
  if (!running_ || !touch_.request.by_edges || touch_.request.switch_of != of) return;
  if (of == SwitchOf::probe) {
    if (edge.level != before) takeProbeEdge(edge);
  } else {
    takeDeviceEdge(edge);
  }
}

void TouchCapture::takeDeviceEdge(const Edge& edge) {
  if (edge.level == Level::inactive) {
    touch_.release = edge.at;
  } else if (!touch_.contact) {
    touch_.contact = edge.at;
  } else if (touch_.release && *touch_.contact < *touch_.release && edge.at - *touch_.release > kBounce) {
    note(TouchFault::triggered_twice);
  }
}

void TouchCapture::takeProbeEdge(const Edge& edge) {
  const bool opens = edge.level == Level::active;
  const bool first = opens && !touch_.contact;
  if (first) touch_.contact = edge.at;
  if (!touch_.contact) return;
  const bool chatters = first || edge.at <= chatter_end_;
  if (chatters) chatter_end_ = edge.at + kChatter;
  if (!touch_.release) {
    if (!opens) touch_.release = edge.at;
  } else if (opens && chatters) {
    touch_.release.reset();  // that was chatter of the contact
  } else if (edge.at - *touch_.release > kBounce) {
    note(TouchFault::triggered_twice);
  }
}

bool TouchCapture::needs(Source source) const {
  const auto& request = touch_.request;
  if (source == Source::probe) return !request.sweeps && !request.by_edges;
  if (source == Source::drift) return request.sweeps;
  return source != Source::trigger || request.by_edges;
}

TouchFault TouchCapture::end(const TickMap& map) {
  touch_.map = map;
  touch_.machine_end = recording_.machineRowCount();
  touch_.probe_end = recording_.probeRowCount();
  touch_.drift_end = recording_.driftRowCount();
  touch_.angle_end = recording_.angleRowCount();
  if (map.state != ClockState::locked) note(TouchFault::clock_not_locked);
  if (touch_.machine_end - touch_.machine_begin < kFewestRows) note(TouchFault::no_machine_rows);
  if (needs(Source::drift) && touch_.drift_end - touch_.drift_begin < kFewestRows) note(TouchFault::no_drift_rows);
  if (needs(Source::probe) && touch_.probe_end - touch_.probe_begin < kFewestRows) note(TouchFault::no_probe_rows);
  if (touch_.request.until_contact) {
    note(faultOf(lackOf(recording_, touch_)));
  } else if (touch_.request.by_edges) {
    note(edgeFault());
  }
  const bool stands = touch_.request.holds || touch_.request.rest_s > 0 || touch_.request.until_contact;
  if (stands && !stoodStill()) note(TouchFault::moved);
  if (touch_.request.rest_s > 0 && !restedLongEnough()) note(TouchFault::rest_too_short);
  if (fault_ == TouchFault::none && touch_.request.scan.count > 0 && hasHole()) note(TouchFault::samples_missing);
  if (fault_ == TouchFault::none) keepTouch();
  running_ = false;
  if (fault_ != TouchFault::none) recording_.truncate(touch_);
  return fault_;
}

void TouchCapture::keepTouch() {
  keepNearContact(recording_, touch_);
  // An encoder may have been silent at the contact alone.
  if (touch_.machine_end - touch_.machine_begin < kFewestRows) return note(TouchFault::no_machine_rows);
  if (!recording_.append(touch_)) note(TouchFault::recording_full);
}

TouchFault TouchCapture::edgeFault() const {
  if (touch_.contact && touch_.release && *touch_.contact < *touch_.release) return TouchFault::none;
  return touch_.request.switch_of == SwitchOf::probe ? TouchFault::no_trigger : TouchFault::no_edges;
}

bool TouchCapture::stoodStill() const {
  const auto rows = recording_.machineRows(touch_);
  if (rows.empty()) return true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto [lowest, highest] =
        std::ranges::minmax(rows, {}, [axis](const MachineRow& row) { return row.counts[axis]; });
    const auto counts = static_cast<double>(highest.counts[axis] - lowest.counts[axis]);
    if (!(std::abs(counts * mm_per_count_[axis]) <= kStill_mm)) return false;
  }
  return true;
}

// The first and the last reading come up to an interval of the sensor inside the markers.
bool TouchCapture::restedLongEnough() const {
  const auto rows = recording_.driftRows(touch_);
  if (rows.size() < 2) return false;
  const double span_s = toSeconds(rows.back().at - rows.front().at);
  return span_s * static_cast<double>(rows.size() + 1) / static_cast<double>(rows.size() - 1) >= touch_.request.rest_s;
}

bool TouchCapture::hasHole() const {
  return hasHoleIn(recording_.machineRows(touch_)) || hasHoleIn(recording_.probeRows(touch_));
}

void TouchCapture::abandon() {
  if (running_) recording_.truncate(touch_);
  running_ = false;
}

void TouchCapture::note(TouchFault fault) {
  if (fault_ == TouchFault::none) fault_ = fault;
}

}  // namespace probebox::capture
