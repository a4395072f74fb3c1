#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/whole_touch.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kBendOver_s = 0.0025;   // in which a ramp has to show
constexpr double kBendOverNoise = 60.0;  // of the noise at the speed: so far away a stop shows
constexpr double kLevel = 0.3;           // of the deflection at rest: no ramp lasts until there
constexpr double kHigh = 0.4;            // between these the deflection falls evenly
constexpr double kDeep = 0.1;
constexpr std::size_t kLeastStretch = 4;  // samples
constexpr double kFragment = 0.3;         // of the longest stretch of a way

// Longest straight stretches within some samples, the parts beside the longest one in the same way: a kink that noise
// hides between two samples parts a stretch by the line through the rest of it.
void addStraightRuns(std::span<const double> times, std::span<const double> along, Run within, double noise,
                     std::vector<Run>& runs) {
  if (within.size() < kLeastStretch) return;
  Run found = steadyRun(times.subspan(within.begin, within.size()), along.subspan(within.begin, within.size()),
                        {0, within.size()}, noise)
                  .run;
  found = {found.begin + within.begin, found.end + within.begin};
  if (found.size() < kLeastStretch) return;
  addStraightRuns(times, along, {within.begin, found.begin}, noise, runs);
  runs.push_back(found);
  addStraightRuns(times, along, {found.end, within.end}, noise, runs);
}

// Stretches of a stream on a straight line: between them samples miss the line through others beside them.
std::vector<Run> straightRuns(std::span<const double> times, std::span<const double> along, double noise,
                              double speed) {
  const std::size_t n = times.size();
  const double period = (times.back() - times.front()) / static_cast<double>(n - 1);
  const double apart = std::max(kBendOver_s, kBendOverNoise * noise / speed);
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(apart / period)));
  const double allowed = 6.0 * std::sqrt(1.5) * noise;
  std::vector<Run> runs;
  std::size_t begin = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t before = k < stride ? 0 : k - stride;
    const std::size_t after = std::min(n - 1, k + stride);
    if (before == k || after == k) continue;
    const double share = (times[k] - times[before]) / (times[after] - times[before]);
    if (std::abs(along[k] - along[before] - share * (along[after] - along[before])) <= allowed) continue;
    addStraightRuns(times, along, {begin, std::max(begin, k)}, noise, runs);
    begin = k + 1;
  }
  addStraightRuns(times, along, {begin, std::max(begin, n)}, noise, runs);
  return runs;
}

// Time at which a signal passes a level between k - 1 and k.
double crossing(const std::vector<double>& times, const std::vector<double>& values, std::size_t k, double level) {
  return times[k - 1] + (level - values[k - 1]) / (values[k] - values[k - 1]) * (times[k] - times[k - 1]);
}

// Where few samples are taken a bounce looks like spikes, several of them in a row.
Stream withoutLoneSpikes(const Stream& stream, double jitter_s) {
  const auto removed = withoutSpikes(stream, jitter_s).removed;
  const auto is_removed = [&](std::size_t k) { return std::ranges::find(removed, stream.times[k]) != removed.end(); };
  std::vector<Index> kept;
  for (std::size_t k = 0; k < stream.times.size(); ++k) {
    const bool alone = (k == 0 || !is_removed(k - 1)) && (k + 1 == stream.times.size() || !is_removed(k + 1));
    if (!is_removed(k) || !alone) kept.push_back(static_cast<Index>(k));
  }
  Stream left;
  for (const Index k : kept) left.times.push_back(stream.times[static_cast<std::size_t>(k)]);
  left.values = stream.values(kept, Eigen::all);
  left.steps = stream.steps ? stream.steps : stepsOf(stream);
  return left;
}

// Mean direction of the large deflections; nothing without any.
std::optional<Eigen::Vector3d> directionOfTouch(const Stream& probe) {
  const VectorXd size = probe.values.rowwise().norm();
  const double highest = size.maxCoeff();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Index k = 0; k < size.size(); ++k) {
    if (size[k] > 0.5 * highest) sum += probe.values.row(k).transpose();
  }
  if (!(highest > 0.0) || !(sum.norm() > 0.0)) return std::nullopt;
  return sum.normalized();
}

}  // namespace

Outcome<TouchRecord::Pressed, Refusal> TouchRecord::pressed() const {
  const auto& bent = deflection_;
  const double highest = probe_.values.rowwise().norm().maxCoeff();
  std::vector<double> large;
  for (const double one : bent) {
    if (one > 0.8 * highest) large.push_back(one);
  }
  if (large.empty()) return refused("deflection-unsteady", "the deflection at rest has no one direction; touch again");
  const double rest = median(large);
  const auto above = [&](double one) { return one >= kLevel * rest; };
  const auto first = static_cast<std::size_t>(std::ranges::find_if(bent, above) - bent.begin());
  std::size_t last = bent.size();
  while (last > 0 && !above(bent[last - 1])) --last;
  if (last == bent.size())
    return refused("truncated", "the record ends before the stylus leaves the surface; measure it again");
  return Pressed{rest, first, last};
}

Outcome<TouchRecord, Refusal> TouchRecord::read(const Touch& touch, const StampJitter& jitter) {
  TouchRecord record;
  record.plan_ = touch.plan;
  record.machine_ = withoutSpikes(touch.machine, jitter.machine_s).stream;
  record.machine_.steps = stepsOf(record.machine_);  // which the solver asks for often
  record.probe_ = withoutLoneSpikes(touch.probe, jitter.probe_s);
  const Stream& machine = record.machine_;
  const Stream& probe = record.probe_;
  if (machine.times.size() < 2 * kLeastStretch || probe.times.size() < 2 * kLeastStretch)
    return record.refused("truncated", "the record is too short; measure it again");
  record.place_ = machine.along(touch.plan.retract, {0, machine.times.size()});
  const auto channels = directionOfTouch(probe);
  if (!channels)
    return record.refused("no-contact", "no deflection of the probe; check that the touch reached the surface");
  record.channels_ = *channels;
  record.deflection_ = probe.along(record.channels_, {0, probe.times.size()});
  TRY(const auto pressed, record.pressed());
  record.setLeastNoise();
  const double still = std::max(noiseOf(machine, touch.plan.retract), record.least_.machine.at_rest);
  const double moving = std::hypot(still, jitter.machine_s * touch.plan.speed_mm_s);
  record.noise_.machine = {moving, still, 0.0};
  record.findStretches();
  if (auto refusal = record.findStart(pressed)) return *refusal;
  const double quiet = std::max(noiseOf(probe, record.channels_), record.least_.probe.at_rest);
  const double gain = record.start_[2];
  record.noise_.probe = {std::hypot(quiet, jitter.probe_s * gain * touch.plan.speed_mm_s), quiet, 0.0};
  return record;
}

void TouchRecord::setLeastNoise() {
  const auto least = [](const Stream& stream, const Eigen::Vector3d& seen) {
    const double of_steps = stepsOf(stream).cwiseProduct(seen).norm() / std::sqrt(12.0);
    const double sd = std::max(of_steps, kCaseDigits);
    return StreamNoise{sd, sd, 0.0};
  };
  least_ = {least(machine_, plan_.retract), least(probe_, channels_)};
}

void TouchRecord::findStretches() {
  const Eigen::Vector3d& along = plan_.retract;
  const auto low = static_cast<std::size_t>(std::ranges::min_element(place_) - place_.begin());
  const double slow = 0.02 * plan_.speed_mm_s;
  for (const Run run : straightRuns(machine_.times, place_, noise_.machine.moving, plan_.speed_mm_s)) {
    const Line line = fitLine(machine_.timesOf(run), machine_.valuesOf(run));
    const double slope = line.slope.dot(along);
    const State state = std::abs(slope) <= slow ? State::rest : slope < 0.0 ? State::in : State::out;
    if (state == State::in && machine_.times[run.begin] > machine_.times[low]) continue;
    if (state == State::out && machine_.times[run.end - 1] < machine_.times[low]) continue;
    stretches_.push_back({run, state, line});
  }
  // Short ones beside long ones of the same way are of its ramps.
  for (const State state : {State::in, State::out}) {
    std::size_t longest = 0;
    for (const auto& one : stretches_) {
      if (one.state == state) longest = std::max(longest, one.run.size());
    }
    std::erase_if(stretches_, [&](const Stretch& one) {
      return one.state == state && static_cast<double>(one.run.size()) < kFragment * static_cast<double>(longest);
    });
  }
}

const TouchRecord::Stretch* TouchRecord::way(State state) const {
  const auto is_way = [&](const Stretch& one) { return one.state == state; };
  if (state == State::in) {
    const auto last = std::ranges::find_if(stretches_.rbegin(), stretches_.rend(), is_way);
    return last == stretches_.rend() ? nullptr : &*last;
  }
  const auto first = std::ranges::find_if(stretches_, is_way);
  return first == stretches_.end() ? nullptr : &*first;
}

std::optional<Refusal> TouchRecord::findStart(const Pressed& pressed) {
  const auto& times = probe_.times;
  const auto& bent = deflection_;
  const auto& [rest, first, last] = pressed;
  const Stretch* out = way(State::out);
  if (out == nullptr)
    return refused("speed-not-constant", "the machine does not retract at constant speed; reduce the speed");
  // Time in which the deflection falls from one level to another.
  std::size_t high = last;
  while (high > 0 && bent[high - 1] < kHigh * rest) --high;
  std::size_t deep = last;
  while (deep < bent.size() && bent[deep] >= kDeep * rest) ++deep;
  if (high == 0 || deep == bent.size())
    return refused("truncated", "the record ends before the stylus leaves the surface; measure it again");
  const double falls = crossing(times, bent, deep, kDeep * rest) - crossing(times, bent, high, kHigh * rest);
  depth_mm_ = out->line.slope.dot(plan_.retract) * falls / (kHigh - kDeep);

  // The way out crosses a level of the deflection; so does the way in.
  const double falling_at = crossing(times, bent, last, kLevel * rest);
  const double middle = *std::ranges::min_element(place_) + (1.0 - kLevel) * depth_mm_;
  const double passed = out->line.timeAt(plan_.retract, middle);
  double tau = passed - falling_at;
  const Stretch* in = way(State::in);
  has_way_in_ = first > 0 && in != nullptr;
  if (has_way_in_) {
    tau = 0.5 * (passed + in->line.timeAt(plan_.retract, middle)) -
          0.5 * (falling_at + crossing(times, bent, first, kLevel * rest));
  }
  const double place = out->line.at(falling_at + tau).dot(plan_.retract) + kLevel * depth_mm_;
  start_ = {tau, place, rest / depth_mm_, 0.0};
  return std::nullopt;
}

}  // namespace probebox::metrology
