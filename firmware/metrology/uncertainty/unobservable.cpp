#include "firmware/metrology/uncertainty/unobservable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

struct Known {
  std::string_view methods;  // the start of their names
  std::string_view what;
};

// In the order in which they are said.
constexpr auto kKnown = std::to_array<Known>({
    {"delay-", "tau_machine and tau_probe separately: only tau = tau_machine - tau_probe (A1)"},
    {"delay-", "a delay that comes after the stamps: links, USB"},
    {"delay-known-sphere", "delays that differ between the axes: one delay is assumed for all"},
    {"delay-multi-speed", "delays that differ between the axes: one delay is assumed for all"},
    {"delay-multi-speed",
     "the causes of the static error separately: size of the ball, threshold of the probe and form are one number"},
    {"delay-non-normal", "delays that differ between the axes: one delay is assumed for all"},
    {"delay-feature", "delays that differ between the axes, where one is assumed for all"},
    {"delay-feature", "form of the feature and its deviation from the stated direction: both are assumed exact"},
    {"delay-joints", "lengths and axes of the chain and the zeros of its joints: the stated ones are assumed exact"},
    {"delay-joints", "delays that differ between the joints, where one is assumed for all"},
    {"delay-plates", "the delay of an axis across the normal of the faces"},
    {"delay-in-out", "the delay of an axis across the direction of motion, and the position of the surface"},
    {"delay-contour",
     "delays that differ between the axes; size and position of the feature: both are nuisance parameters of each "
     "scan"},
    {"delay-contour", "form of the feature and its deviation from the stated direction: both are assumed exact"},
    {"delay-stepped-scan",
     "delays that differ between the axes, and the radius: both are nuisance parameters of each scan"},
    {"centreline", "first harmonics of EXC and EYC separately from the position of the axis, XOC and YOC"},
    {"centreline", "the direction of the axis: the readings are at one height"},
    {"c-zero-shift", "the offset of the stylus from the spindle, beyond what two opposite contacts cancel"},
    {"spindle-offset-2x2", "first harmonics of C and of the spindle separately from the offsets of ball and stylus"},
    {"c-axis-alignment",
     "the axis separately from the straightness and squareness of the Z slide: the tilt is relative to Z"},
    {"a-axis-alignment",
     "the axis separately from the straightness and squareness of the Z slide: the tilt is relative to Z"},
    {"table-pivot",
     "the position of the pivot along the tilt axis, and first harmonics of the tilt axis separately from its "
     "position"},
    {"head-pivot", "the position of the pivot along the swivel axis"},
    {"head-pivot", "an error of ball_mm: it biases the pivot with unit sensitivity"},
    {"swivel-error", "any error at B = 0: all results are relative to B = 0"},
    {"swivel-error", "errors between the measured angles that the model does not contain"},
    {"periodic-check", "run-out of ball and stylus at B = 45 and 90: it cancels"},
    {"periodic-check",
     "x_offset_error_mm and z_offset_error_mm separately from errors of the ball's radius and expected centre"},
    {"rotary-axis-errors", "XOC and YOC separately from position-dependent first harmonics (EXC, EYC)"},
    {"rotary-axis-errors", "any error at the reference angle, and errors of the linear axes that all angles share"},
    {"screw-", "a temperature that varies along the screw: the sensor measures the extension of its whole length"},
    {"screw-calibration", "the mean height of the face separately from the zero of the sensor: the table sums to 0"},
    {"sensor-head-calibration",
     "the position of the ball separately from that of the head's reference: only moves relative to it"},
    {"selftest", "errors below its limits, 2 % of a travel and 30 degrees of a push: calibrations find these"},
    {"sphere-fit", "radius of the sphere and of the stylus ball separately: only their sum"},
    {"sphere-fit", "form of the sphere separately from the noise of the readings"},
    {"bore-fit", "form of the bore separately from the noise of the readings"},
    {"boss-fit", "form of the boss separately from the noise of the readings"},
    {"pocket-fit", "anything across the stated width_direction, and how far the faces are from parallel"},
    {"web-fit", "anything across the stated width_direction, and how far the faces are from parallel"},
    {"corner-fit", "form of the faces separately from the noise of the readings"},
    {"tool-assembly", "an error of L1_mm: it biases the assembled length with unit sensitivity"},
    {"tool-setter", "an error of probe_offset_mm: it biases tool and setting device with unit sensitivity"},
});

// The same angle for all rows, whole turns aside; nothing without such a column.
std::optional<bool> constant(const Table& table, std::string_view column) {
  const auto* angles = table.column(column);
  if (angles == nullptr || angles->empty()) return std::nullopt;
  return std::ranges::all_of(*angles,
                             [&](double angle) { return std::abs(std::sin((angle - angles->front()) / 2.0)) < 1e-6; });
}

// Spindle and C turned by the same angles.
bool turnedTogether(const Table& table) {
  const auto* spindle = table.column("A_rad");
  const auto* c = table.column("C_rad");
  if (spindle == nullptr || c == nullptr || spindle->size() != c->size()) return false;
  for (std::size_t k = 0; k < c->size(); ++k) {
    const double apart = ((*spindle)[k] - (*c)[k]) - (spindle->front() - c->front());
    if (std::abs(std::sin(apart / 2.0)) > 1e-6) return false;
  }
  return true;
}

void addOfBalls(Result& result, const Dataset& dataset) {
  const Table* table = dataset.table("readings");
  if (table == nullptr) return;
  if (constant(*table, "A_rad").value_or(false)) {
    result.unobservable.emplace_back(
        "the spindle axis: the spindle stood still, so its axis cannot be separated from the tip");
  } else if (constant(*table, "C_rad").value_or(false)) {
    result.unobservable.emplace_back("the C axis: C stood still, so its axis cannot be separated from the ball");
  } else if (turnedTogether(*table)) {
    result.unobservable.emplace_back(
        "offsets of ball and stylus separately: spindle and C turned together, so only ball minus stylus");
  }
}

// A known size stands for the delay where all touches ran at one speed (A9).
void addOfOneSpeed(Result& result, const Dataset& dataset) {
  if (dataset.table("article")) return;  // which moves too: what counts is not the probe's speed
  const Table* touches = dataset.table("touches");
  const auto* speeds = touches == nullptr ? nullptr : touches->column("speed_mm_s");
  if (speeds == nullptr || speeds->empty()) return;
  const auto [slowest, fastest] = std::ranges::minmax(*speeds);
  if (slowest < fastest || !(slowest > 0.0)) return;
  result.unobservable.push_back("tau separately from an error of the known size: at one speed 1 um of size is " +
                                text(1e3 / (2.0 * slowest)) + " us of tau (A9)");
}

}  // namespace

void addUnobservable(Result& result, const Dataset& dataset) {
  for (const auto& known : kKnown) {
    if (dataset.method.starts_with(known.methods)) result.unobservable.emplace_back(known.what);
  }
  constexpr std::array<std::string_view, 6> kOfTouches{"delay-feature",    "delay-joints",   "delay-known-sphere",
                                                       "delay-non-normal", "delay-per-axis", "delay-plates"};
  if (std::ranges::find(kOfTouches, dataset.method) != kOfTouches.end()) addOfOneSpeed(result, dataset);
  addOfBalls(result, dataset);
}

}  // namespace probebox::metrology
