#include "firmware/metrology/retract.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/spikes.hpp"

namespace probebox::metrology {
namespace {

constexpr std::size_t kLeastSamples = 5;
constexpr double kResolution = 1e-7;  // unit of the stream: the digits of a case file
// Fractions of the deflection at rest between which the probe's line is fitted. The lower keeps off the seating of the
// stylus; above the upper the machine still gathers speed.
constexpr double kAtRest = 0.85;
constexpr double kLowest = 0.04;
constexpr double kHighest = 0.80;
// The window of the source. All of it must lie on the line, but where the machine still gathers speed.
constexpr double kSourceLowest = 0.10;
constexpr double kSourceHighest = 0.60;
// How much of that window may miss: a spike, the guard of a cut.
constexpr double kMissing = 0.25;
// The machine's window in overtravels from its apex.
constexpr double kFrom = 0.25;
constexpr double kUntil = 3.0;
constexpr double kTrustedFrom = 0.8;
// The latest that the machine may reach its speed.
constexpr double kLatestRamp = 0.7;
// After a fast drive and a short rest the stylus still rings from the approach, and the end of a ramp hides in the
// noise: so much later, as long as the window of the source stays.
constexpr double kSettling_s = 0.004;
// The most that a sawtooth of one step, some turns of it long, bends in the coefficient of (share of the window)^2.
constexpr double kBendOfSteps = 2.9;

struct Deflected {
  Eigen::Vector3d apex;  // deflection at rest
  std::size_t last{};    // last sample near rest: the retract begins about here
  std::size_t parted{};  // first sample after it that is hardly deflected
};

Refusal refusal(const Touch& touch, std::string name, const std::string& what) {
  return {std::move(name), touch.plan.name + ": " + what};
}

Outcome<Deflected, Refusal> findContact(const Touch& touch) {
  const auto& values = touch.probe.values;
  const Eigen::VectorXd size = values.rowwise().norm();
  const double highest = size.maxCoeff();
  Deflected found;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<double> large;
  for (Eigen::Index k = 0; k < size.size(); ++k) {
    if (size[k] < 0.8 * highest) continue;
    sum += values.row(k).transpose();
    large.push_back(size[k]);
  }
  // High among the large ones: below are the ends of a slow drive, above is the overshoot of a bounce.
  const auto rest = large.begin() + static_cast<std::ptrdiff_t>(4 * large.size() / 5);
  std::nth_element(large.begin(), rest, large.end());
  found.apex = *rest * sum.normalized();
  const std::vector<double> deflection = touch.probe.along(found.apex.normalized(), {0, touch.probe.times.size()});
  if (highest <= std::max(10.0 * localDeviation(touch.probe.times, deflection, Trim::heavy), 10.0 * kResolution)) {
    return refusal(touch, "no-contact",
                   "the probe was never deflected clearly; check that the touch reached the surface");
  }
  const Eigen::VectorXd share = values * found.apex / found.apex.squaredNorm();
  for (Eigen::Index k = 0; k < share.size(); ++k) {
    if (share[k] >= kAtRest) found.last = static_cast<std::size_t>(k);
  }
  found.parted = found.last;
  while (found.parted < touch.probe.times.size() && share[static_cast<Eigen::Index>(found.parted)] >= kSourceLowest)
    ++found.parted;
  if (found.parted == touch.probe.times.size()) {
    return refusal(touch, "truncated", "the probe's record ends before it parts from the surface; measure it again");
  }
  return found;
}

// The samples whose stamps lie in [from, until].
Run between(const std::vector<double>& times, double from, double until) {
  const auto begin = std::ranges::lower_bound(times, from);
  const auto end = std::ranges::upper_bound(times, until);
  if (end <= begin) return {};
  return {static_cast<std::size_t>(begin - times.begin()), static_cast<std::size_t>(end - times.begin())};
}

std::optional<Refusal> unfit(const Touch& touch, const std::string& stream, std::span<const double> times) {
  if (times.size() < kLeastSamples) {
    return refusal(touch, "too-few-samples",
                   std::to_string(times.size()) + " " + stream +
                       " samples at constant speed, five are needed; retract slower, or "
                       "further, or sample faster");
  }
  double widest = 0.0;
  for (std::size_t k = 1; k < times.size(); ++k) widest = std::max(widest, times[k] - times[k - 1]);
  if (widest > 0.4 * (times.back() - times.front())) {
    return refusal(touch, "gap",
                   "the " + stream + " samples have a gap of " + text(widest) +
                       " s during the retract; find out why samples are lost and measure again");
  }
  return std::nullopt;
}

// Speed change over the window, relative, where it stands out of the noise; 0 where it does not. noise: least deviation
// of one sample to reckon with, as a few residuals may be small by chance. bend: that the encoder's steps may feign.
double speedChange(std::span<const double> times, std::span<const double> values, double noise, double bend) {
  const auto n = static_cast<Eigen::Index>(times.size());
  const Eigen::Map<const Eigen::ArrayXd> t{times.data(), n};
  const Eigen::Map<const Eigen::ArrayXd> x{values.data(), n};
  const double length = times.back() - times.front();
  const Eigen::ArrayXd s = (t - t[0]) / length - 0.5;
  Eigen::MatrixXd basis{n, 3};
  basis << Eigen::ArrayXd::Ones(n), s, s.square();
  const Eigen::MatrixXd normal = basis.transpose() * basis;
  const Eigen::Vector3d fitted = normal.ldlt().solve(basis.transpose() * (x - x[0]).matrix());
  const double variance = ((x - x[0]).matrix() - basis * fitted).squaredNorm() / static_cast<double>(n - 3);
  const double sd = std::sqrt(std::max(variance, noise * noise) * normal.inverse()(2, 2)) + kResolution;
  // With few samples the sd itself is uncertain.
  const double limit = 5.0 * (1.0 + 4.0 / static_cast<double>(n - 3));
  return std::abs(fitted[2]) > limit * sd + bend ? std::abs(2.0 * fitted[2] / fitted[1]) : 0.0;
}

struct Window {
  Run offered;  // samples that may belong
  Run trusted;  // those of them that hardly hold a ramp
};

struct Steady {
  Line line;
  Rounding rounding;
  Run used;
  std::vector<std::string> spikes;
};

std::string stampOf(const std::string& stream, double time) {
  return stream + " at " + text(time) + " s";
}

// The line through a run without its spikes.
Steady lineOf(const Stream& stream, const std::string& name, const SteadyRun& steady, std::size_t from,
              const Eigen::Vector3d& steps) {
  Steady result{{}, {}, {from + steady.run.begin, from + steady.run.end}, {}};
  if (steady.spikes.empty()) {
    result.line = fitLine(stream.timesOf(result.used), stream.valuesOf(result.used));
    result.rounding = Rounding{stream.timesOf(result.used), result.line, steps};
    return result;
  }
  std::vector<double> times;
  std::vector<Eigen::Index> rows;
  for (std::size_t k = steady.run.begin; k < steady.run.end; ++k) {
    if (std::ranges::binary_search(steady.spikes, k)) {
      result.spikes.push_back(stampOf(name, stream.times[from + k]));
      continue;
    }
    times.push_back(stream.times[from + k]);
    rows.push_back(static_cast<Eigen::Index>(from + k));
  }
  const Rows3 values = stream.values(rows, Eigen::all);
  result.line = fitLine(times, values);
  result.rounding = Rounding{times, result.line, steps};
  return result;
}

// Of the encoder or converter of each channel.
Eigen::Vector3d stepsOf(const Stream& stream) {
  Eigen::Vector3d steps;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd channel = stream.values.col(k);
    steps[k] = resolutionOf(std::span{channel.data(), stream.times.size()});
  }
  return steps;
}

// Deviation of one sample as the whole record tells it: a window alone holds too few to tell noise from a ramp.
double noiseOf(const Stream& stream, const Eigen::Vector3d& direction, double coarsest) {
  const double local = localDeviation(stream.times, stream.along(direction, {0, stream.times.size()}), Trim::heavy);
  return std::max(local, 0.5 * coarsest);
}

// Slip and bounce make the residuals larger than the record's own noise, or many of the samples spikes.
std::optional<Refusal> tooRough(const Touch& touch, const std::string& name, const Stream& stream, const Steady& steady,
                                const Eigen::Vector3d& direction, double noise) {
  const double rms = std::sqrt(steady.line.scatterAlong(direction) / static_cast<double>(steady.line.n - 2));
  const double sigma =
      std::max({noise, kResolution,
                localDeviation(stream.timesOf(steady.used), stream.along(direction, steady.used), Trim::light)});
  const bool many_spikes = steady.spikes.size() > std::max<std::size_t>(1, steady.used.size() / 10);
  if (rms <= 3.0 * sigma && !many_spikes) return std::nullopt;
  return refusal(touch, "residual-too-large",
                 "the " + name + " samples lie " + text(rms) + " about their line where the record's noise is " +
                     text(sigma) + " (slip or bounce); touch again");
}

Outcome<Steady, Refusal> fitWindow(const Touch& touch, const Stream& stream, const std::string& name, Window window,
                                   const Eigen::Vector3d& direction) {
  if (auto bad = unfit(touch, name, stream.timesOf(window.trusted))) return *bad;
  const std::size_t from = window.offered.begin;
  const Eigen::Vector3d steps = stepsOf(stream);
  const double noise = noiseOf(stream, direction, steps.maxCoeff());
  const SteadyRun run = steadyRun(stream.timesOf(window.offered), stream.along(direction, window.offered),
                                  {window.trusted.begin - from, window.trusted.end - from}, noise);
  const Run used{from + run.run.begin, from + run.run.end};
  if (auto bad = unfit(touch, name, stream.timesOf(used))) return *bad;
  const Steady steady = lineOf(stream, name, run, from, steps);
  const double change =
      speedChange(stream.timesOf(used), stream.along(direction, used), noise, kBendOfSteps * steps.maxCoeff());
  if (change > 0.02) {
    return refusal(touch, "speed-not-constant",
                   "the " + name + " speed changes by " + text(100.0 * change) +
                       " % during the retract, 2 % are allowed; retract at constant feed, "
                       "with the override locked");
  }
  if (auto bad = tooRough(touch, name, stream, steady, direction, noise)) return *bad;
  return steady;
}

// The probe's line over all that falls, ramp included: to find windows with.
Outcome<Line, Refusal> roughLine(const Touch& touch, const Deflected& contact) {
  const Run falling{contact.last, contact.parted};
  if (auto bad = unfit(touch, "probe", touch.probe.timesOf(falling))) return *bad;
  const Line line = fitLine(touch.probe.timesOf(falling), touch.probe.valuesOf(falling));
  if (!(line.slope.dot(contact.apex) < 0.0)) {
    return refusal(touch, "deflection-not-falling",
                   "the deflection does not fall during the retract; measure it again");
  }
  return line;
}

// Samples of the source's window that the line leaves out, below what the machine's ramp explains.
bool interrupted(const Stream& probe, Run window, Run used) {
  const std::size_t begin = std::max(window.begin, used.begin);
  const std::size_t end = std::min(window.end, used.end);
  const std::size_t missing = window.size() - (end > begin ? end - begin : 0);
  return missing > 2 && static_cast<double>(missing) > kMissing * static_cast<double>(window.size()) &&
         probe.times.size() > missing;
}

// The window lies between shares of the deflection as a line tells them, not the samples: noise must not choose which
// belong.
Outcome<Steady, Refusal> fitProbe(const Touch& touch, const Deflected& contact, const Line& rough, double highest) {
  const Eigen::Vector3d direction = contact.apex.normalized();
  const auto timeAt = [&](double share) {
    return rough.t_mean + (share * contact.apex.norm() - rough.mean.dot(direction)) / rough.slope.dot(direction);
  };
  const Run window = between(touch.probe.times, timeAt(highest), timeAt(kLowest));
  auto steady = fitWindow(touch, touch.probe, "probe", {window, window}, direction);
  if (!steady) return steady;
  const Run of_source = between(touch.probe.times, timeAt(std::min(kSourceHighest, highest)), timeAt(kSourceLowest));
  if (interrupted(touch.probe, of_source, steady->used)) {
    return refusal(touch, "residual-too-large",
                   "the deflection does not fall along one line during the retract (slip or bounce); touch again");
  }
  return steady;
}

// Travel of the machine from its apex, mm, at every sample.
std::vector<double> travelOf(const Touch& touch, std::size_t apex) {
  std::vector<double> travel = touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()});
  const double rest = travel[apex];
  for (double& at : travel) at -= rest;
  return travel;
}

Outcome<Steady, Refusal> fitMachine(const Touch& touch, std::size_t apex, const std::vector<double>& travel,
                                    double overtravel_mm) {
  if (*std::max_element(travel.begin() + static_cast<std::ptrdiff_t>(apex), travel.end()) < overtravel_mm) {
    return refusal(touch, "truncated",
                   "the machine's record ends before the probe can have parted from the surface; "
                   "measure it again");
  }
  const auto last_below = [&](double limit) {
    std::size_t k = apex;
    while (k < travel.size() && travel[k] < limit) ++k;
    return k;
  };
  Window window;
  // With some of the rest, which tells how sharply the ramp bends.
  window.offered = {apex - std::min(apex, kLeastSamples), last_below(kUntil * overtravel_mm)};
  window.trusted = {last_below(kTrustedFrom * overtravel_mm), window.offered.end};
  if (window.trusted.size() < kLeastSamples) window.trusted = {last_below(kFrom * overtravel_mm), window.offered.end};
  auto steady = fitWindow(touch, touch.machine, "machine", window, touch.plan.retract);
  if (!steady) return steady;
  const bool late = travel[steady->used.begin] > kLatestRamp * overtravel_mm;
  if (late || travel[steady->used.end - 1] < overtravel_mm) {
    return refusal(touch, "speed-not-constant",
                   late ? "the machine still gathers speed when the probe parts; drive deeper, or slower"
                        : "the machine's speed changes before the probe parts; retract further at constant feed");
  }
  return steady;
}

std::optional<Refusal> wrongMotion(const Touch& touch, const Line& machine) {
  const double speed = machine.slope.norm();
  if (machine.slope.dot(touch.plan.retract) < 0.99 * speed) {
    return refusal(touch, "wrong-direction",
                   "the machine did not retract along (ux,uy,uz); correct the table of touches");
  }
  if (std::abs(speed - touch.plan.speed_mm_s) > 0.2 * touch.plan.speed_mm_s) {
    return refusal(touch, "speed-differs",
                   "the machine retracts at " + text(speed) + " mm/s where " + text(touch.plan.speed_mm_s) +
                       " is stated; set the feed override to 100 %");
  }
  return std::nullopt;
}

// The retract's lines from streams without spikes.
Outcome<Retract, Refusal> linesOf(const Touch& touch) {
  const auto contact = findContact(touch);
  if (!contact) return contact.error();
  const auto rough = roughLine(touch, contact.value());
  if (!rough) return rough.error();
  const std::vector<double> along = touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()});
  const auto apex = static_cast<std::size_t>(std::ranges::min_element(along) - along.begin());
  const std::vector<double> travel = travelOf(touch, apex);
  // Overtravel as the nominal speed and the probe's time to separation tell it: the gain need not be known.
  const double overtravel_mm = touch.plan.speed_mm_s * contact->apex.norm() / rough->slope.norm();
  const auto machine = fitMachine(touch, apex, travel, overtravel_mm);
  if (!machine) return machine.error();
  if (auto bad = wrongMotion(touch, machine->line)) return *bad;
  // Where the machine reaches its speed the deflection begins to fall evenly.
  const double ramp = travel[machine->used.begin] / overtravel_mm;
  const double settling = kSettling_s * machine->line.slope.norm() / overtravel_mm;
  const double highest = std::min(kHighest, std::max(1.0 - ramp - settling, std::min(kSourceHighest, 1.0 - ramp)));
  const auto probe = fitProbe(touch, contact.value(), rough.value(), highest);
  if (!probe) return probe.error();
  std::vector<std::string> spikes = machine->spikes;
  spikes.insert(spikes.end(), probe->spikes.begin(), probe->spikes.end());
  return Retract{.plan = touch.plan,
                 .machine = machine->line,
                 .probe = probe->line,
                 .machine_apex = touch.machine.values.row(static_cast<Eigen::Index>(apex)),
                 .probe_apex = contact->apex,
                 .spikes = std::move(spikes),
                 .rounding = machine->rounding};
}

// Names of the removed samples from the rest at the apex on: before it the stylus bounces.
void nameSpikes(Retract& retract, const std::string& stream, const Line& line, const std::vector<double>& removed) {
  const double half = std::sqrt(3.0 * line.sxx / static_cast<double>(line.n));
  for (const double time : removed) {
    if (std::abs(time - line.t_mean) <= half) retract.spikes.push_back(stampOf(stream, time));
  }
}

}  // namespace

double separationTime(const Line& probe) {
  return probe.t_mean - probe.mean.dot(probe.slope) / probe.slope.squaredNorm();
}

Eigen::Vector3d separationPoint(const Line& machine, const Line& probe) {
  return machine.at(separationTime(probe));
}

Outcome<Retract, Refusal> fitRetract(const Touch& touch) {
  const Despiked machine = withoutSpikes(touch.machine);
  const Despiked probe = withoutSpikes(touch.probe);
  auto retract = linesOf({touch.plan, machine.stream, probe.stream});
  if (!retract) return retract;
  nameSpikes(retract.value(), "machine", retract->machine, machine.removed);
  nameSpikes(retract.value(), "probe", retract->probe, probe.removed);
  if (touch.joints.size() > 0) {
    retract->joints = fitJointPath(touch.machine.times, touch.joints, touch.machine.values, retract->machine);
  }
  return retract;
}

}  // namespace probebox::metrology
