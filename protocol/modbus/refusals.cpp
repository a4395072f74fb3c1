#include "protocol/modbus/refusals.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace probebox::modbus {
namespace {

constexpr std::array kOthers = std::to_array<RefusalCode>({
    {0, "none"},
    {1, "the request is not complete, or a value of it is out of range"},
    {2, "the box does not know the request"},
    {3, "never sent: a request that service.toml does not allow on a line is answered by Modbus exception 3"},
    {4, "the box is busy, or a run is in progress: try again"},
    {5, "there is no such method, run or result"},
    {6,
     "the options do not fit the method, the machine or the descriptions, or the descriptions lack something that "
     "the method needs: the log of the box says what"},
    {7,
     "not possible in the present state: an axis is not referenced, the clock is not locked, the delay or another "
     "result that the method needs is not calibrated, a cut is on, or no run is in progress"},
    {10,
     "the result differs from the one in force by more than 4 sd or cannot be compared with it, or is a periodic check "
     "that fails a limit or is not proven: look at it; request 4 accepts it all the same"},
    {21, "step: no counts of the machine during it"},
    {22, "step: no samples of the probe during it"},
    {23, "step: the probe was at the end of its range"},
    {24, "step: a source was lost during it"},
    {25, "step: the clock was not locked"},
    {26, "step: the recording is full"},
    {27, "step: the rotary axes were not at the angles of the step"},
    {28, "step: no readings of the screw's sensor during it"},
    {29, "step: the extension of a screw was not known"},
    {30, "step: no edges of the tool-setting device during it"},
    {31, "step: another tool was in the spindle"},
    {32, "step: the sensor head was out of its range"},
    {33, "step: the machine moved during a hold"},
    {34, "step: no edges of the probe's switch during it"},
    {35, "step: the probe's switch was open before it"},
    {36, "step: the probe's switch, or the tool-setting device, tripped twice"},
    {37, "step: the machine stood still for less than the time of the step"},
    {38, "step: the probe came off the surface during a scan"},
    {39, "step: samples were missing during a scan"},
    {40, "step: C turned and nothing touched the stylus"},
    {41, "step: the ball touched the stylus from the wrong side"},
    {42, "step: the angle of C at the contact was not known"},
    {43,
     "step: an axis does not count from where it did when the run began: its encoder was lost or miscounted, or it was "
     "homed anew. The run is over"},
    {44,
     "step: a result about a screw came into force or was rolled back in the run. Once a touch is kept, the run is "
     "over"},
    {60, "step: its end marker did not arrive in time"},
    {99, "a refusal that this version has no number for: see the page of the run"},
});

// The place in this list is the number: append only, and never remove a name.
constexpr std::array kOfSolvers = std::to_array<std::string_view>({
    "angles-too-close",
    "arc-too-short",
    "arm-too-short",
    "axes-exchanged",
    "axis-stood",
    "bad-angle",
    "bad-axis",
    "bad-ball",
    "bad-config",
    "bad-direction",
    "bad-face",
    "bad-flag",
    "bad-legs",
    "bad-loop",
    "bad-sectors",
    "bad-speed",
    "bad-threshold",
    "bad-variant",
    "c-not-turned",
    "centre-error",
    "collinear",
    "compensation-too-large",
    "constant-",
    "contact-lost",
    "coplanar",
    "deflection-not-falling",
    "deflection-unsteady",
    "dependent-angles",
    "dependent-directions",
    "duplicated-angle",
    "duplicated-ball",
    "duplicated-id",
    "duplicated-reading",
    "duplicated-sample",
    "duplicated-touch",
    "empty-sector",
    "empty-table",
    "extension-out-of-limits",
    "extension-span-too-small",
    "faces-differ",
    "faces-parallel",
    "flat-apex",
    "gap",
    "ill-conditioned",
    "incomplete-step",
    "joint-not-moved",
    "length-not-positive",
    "length-span-too-small",
    "length-too-large",
    "level-readings",
    "missing-ball",
    "missing-column",
    "missing-face",
    "missing-id",
    "missing-key",
    "missing-orientation",
    "missing-step",
    "missing-table",
    "missing-touch",
    "moves-too-small",
    "no-contact",
    "no-convergence",
    "no-delay",
    "no-peak",
    "no-sensor-head",
    "no-shank",
    "not-alone",
    "not-at-station",
    "not-deflected",
    "not-finite",
    "not-level",
    "not-on-feature",
    "not-opposed",
    "not-opposite",
    "not-reachable",
    "not-steady",
    "one-sided",
    "outside-machine",
    "pivot-check-disagrees",
    "probe-direction-wrong",
    "probe-not-measured",
    "probe-sign-wrong",
    "radius-out-of-limits",
    "ragged-table",
    "rank-too-small",
    "readings-contradict",
    "residual-too-large",
    "rival-peak",
    "scale-wrong",
    "sense-wrong",
    "sensors-dependent",
    "setter-moved",
    "setter-width-wrong",
    "several-tips",
    "shank-radius-wrong",
    "single-speed",
    "solver-ended",
    "span-too-small",
    "speed-differs",
    "speed-not-constant",
    "speeds-too-close",
    "spindle-not-turned",
    "spread-too-large",
    "steps-disagree",
    "swivel-angle-too-small",
    "tilt-span-too-small",
    "time-not-rising",
    "tip-slip",
    "too-few-balls",
    "too-few-readings",
    "too-few-samples",
    "too-few-turns",
    "too-many-angles",
    "too-many-axes",
    "too-many-loops",
    "tool-not-measured",
    "truncated",
    "uneven-angles",
    "unknown-column",
    "unknown-method",
    "unknown-scan",
    "unknown-touch",
    "width-not-positive",
    "window-too-large",
    "window-too-small",
    "wrong-direction",
    "wrong-face",
    "wrong-result",
    "few-directions",
    "no-pre-travel",
    "pre-travel-negative",
    "mounts-differ",
    "implausible",
    "clipped",
    "constant-sensor",
    "missing-contact",
    "wrong-side",
    "unequal-heights",
    "bad-tool",
    "frozen-channel",
    "outside-screw",
    "errors-too-large",
    "head-swivelled",
    "spindle-turned",
    "not-free",
    "coarse-stamps",
    "off-the-line",
    "probe-not-at-zero",
    "stamps-jump",
    "clocks-differ",
    "x-in-diameters",
    "angle-reversed",
    "axes-delays-differ",
    "way-in-missing",
    "not-separable",
    "not-closed",
});

std::vector<RefusalCode> all() {
  std::vector<RefusalCode> codes{kOthers.begin(), kOthers.end()};
  for (std::size_t i = 0; i < kOfSolvers.size(); ++i)
    codes.push_back({static_cast<std::uint16_t>(refusal::of_solver + i), kOfSolvers[i]});
  return codes;
}

}  // namespace

std::span<const RefusalCode> refusalCodes() {
  static const std::vector<RefusalCode> codes = all();
  return codes;
}

std::uint16_t codeOfRefusal(std::string_view name) {
  if (name.empty()) return refusal::none;
  // A name that ends with a dash stands for those that go on behind it: "constant-distance".
  auto found = std::ranges::find(kOfSolvers, name);
  if (found == kOfSolvers.end()) {
    found = std::ranges::find_if(
        kOfSolvers, [&](std::string_view known) { return known.ends_with('-') && name.starts_with(known); });
  }
  if (found == kOfSolvers.end()) return refusal::not_in_list;
  return static_cast<std::uint16_t>(refusal::of_solver + (found - kOfSolvers.begin()));
}

}  // namespace probebox::modbus
