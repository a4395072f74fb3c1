#include "firmware/app/host/sample_description.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "protocol/units/tolerances.hpp"

namespace probebox::app {
namespace {

// A screw that warms up would change every descriptor; links keep 32 of them.
constexpr double kScrewStep_mm = 0.0002;
constexpr Nanoseconds kScrewPause = std::chrono::seconds{5};
constexpr double kReach_mm = 1000;  // where a slope counts: axes are about this long

std::uint8_t bit(bool set, std::size_t axis) {
  return static_cast<std::uint8_t>(set ? 1U << axis : 0U);
}

bool screwsDiffer(const messages::TipDescription& a, const messages::TipDescription& b) {
  for (std::size_t axis = 0; axis < a.screw_mm.size(); ++axis) {
    const double shift_mm = std::abs(a.screw_mm[axis] - b.screw_mm[axis]);
    const double along_mm = kReach_mm * std::abs(a.screw_slope[axis] - b.screw_slope[axis]);
    if (shift_mm + along_mm > kScrewStep_mm) return true;
  }
  return false;
}

}  // namespace

SampleDescription::SampleDescription(messages::Descriptor descriptor, const ProbeOnMachine& probe)
    : stated_{std::move(descriptor)}, probe_{probe}, descriptor_{stated_} {}

messages::TipDescription SampleDescription::tipOf(const published::DelayInForce& delay,
                                                  const published::ToolInSamples& tool) const {
  messages::TipDescription tip = stated_.tip;
  const auto turned = [&](RotaryAxis axis) {
    return std::abs(tool.angles_rad[static_cast<std::size_t>(axis)].value_or(0)) > kPoseTolerance_rad;
  };
  tip.has_deflection = !probe_.switches && (!probe_.head_tool || tool.tool != *probe_.head_tool);
  tip.turned = turned(RotaryAxis::a) || (probe_.head_swivels && turned(RotaryAxis::b));
  for (std::size_t axis = 0; axis < tool.axes.size(); ++axis) {
    const auto& along = tool.axes[axis];
    tip.referenced |= bit(along.referenced, axis);
    tip.screws |= bit(along.has_screw, axis);
    tip.screws_unknown |= bit(along.has_screw && !along.screw_known, axis);
    tip.offset_mm[axis] = along.offset_mm;
    tip.screw_mm[axis] = along.screw_mm;
    tip.screw_slope[axis] = along.screw_slope;
  }
  if (delay.gain) {
    tip.gain_result_id = delay.result_id;
    tip.gain_sd = delay.gain->sd;
  }
  return tip;
}

bool SampleDescription::differs(std::uint64_t delay_result, const messages::TipDescription& b, MonoTime now) const {
  if (!changed_ || delay_result != descriptor_.delay.result_id) return true;
  const auto& a = descriptor_.tip;
  const bool otherwise = a.has_deflection != b.has_deflection || a.turned != b.turned || a.referenced != b.referenced ||
                         a.screws_unknown != b.screws_unknown || a.offset_mm != b.offset_mm;
  return otherwise || (now - *changed_ >= kScrewPause && screwsDiffer(a, b));
}

bool SampleDescription::update(const published::DelayInForce& delay, const published::ToolInSamples& tool,
                               MonoTime now) {
  const auto tip = tipOf(delay, tool);
  if (!differs(delay.result_id, tip, now)) return false;
  descriptor_.delay = {
      .calibrated = delay.calibrated, .tau_s = delay.tau_s, .sd_s = delay.sd_s, .result_id = delay.result_id};
  descriptor_.gain = delay.gain ? delay.gain->value : stated_.gain;
  descriptor_.tip = tip;
  changed_ = now;
  return true;
}

}  // namespace probebox::app
