#include "firmware/metrology/touch/retract.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/free_stylus.hpp"
#include "firmware/metrology/touch/quantisation.hpp"
#include "firmware/metrology/touch/sample_correlation.hpp"
#include "firmware/metrology/touch/stamp_jumps.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

// One stream of a touch under analysis. Touch and stream must outlive it.
struct AnalysedStream {
  const Touch& touch;
  const Stream& stream;
  std::string name;
  Eigen::Vector3d direction;  // of the motion
  Eigen::Vector3d steps;      // of the encoder or converter of each channel, 0 where there are none
  double noise{};             // deviation of one sample while it moves
  double usual_s{};           // between samples: the median
};

struct Window {
  Run offered;  // samples that may belong to the window
  Run trusted;  // those of them that contain almost no ramp
};

struct Steady {
  Line line;
  QuantisationError rounding;
  Run used;
  std::vector<std::string> spikes;
  Eigen::Matrix3d neighbours = Eigen::Matrix3d::Zero();  // neighbourProducts of the line
};

// Name of a sample: stream and stamp.
std::string stampOf(const std::string& stream, double time);

Refusal aboutTouch(const Touch& touch, std::string name, const std::string& what);

constexpr std::size_t kLeastOfWindow = 3;
constexpr double kMissingPeriods = 3.5;  // between samples: two may be lost anywhere
// The most that a sawtooth of one step, some turns of it long, bends in the coefficient of (share of the window)^2.
constexpr double kBendOfSteps = 2.9;

// Speed change over the window, relative, where it stands out of the noise; 0 where it does not. noise: least deviation
// of one sample to reckon with, as a few residuals may be small by chance. bend: that the encoder's steps may feign.
double speedChange(std::span<const double> times, std::span<const double> values, double noise, double bend) {
  if (times.size() < 4) return 0.0;
  const auto n = static_cast<Eigen::Index>(times.size());
  const Eigen::Map<const Eigen::ArrayXd> t{times.data(), n};
  const Eigen::Map<const Eigen::ArrayXd> x{values.data(), n};
  const double length = times.back() - times.front();
  const Eigen::ArrayXd s = (t - t[0]) / length - 0.5;
  Eigen::MatrixXd basis{n, 3};
  basis << Eigen::ArrayXd::Ones(n), s, s.square();
  const Eigen::Matrix3d normal = basis.transpose() * basis;
  const Eigen::Vector3d fitted = solveCholesky(normal, basis.transpose() * (x - x[0]).matrix());
  const double variance = ((x - x[0]).matrix() - basis * fitted).squaredNorm() / static_cast<double>(n - 3);
  const double sd = std::sqrt(std::max(variance, noise * noise) * inverse(normal)(2, 2)) + kCaseDigits;
  // With few samples the sd itself is uncertain.
  const double limit = 5.0 * (1.0 + 4.0 / static_cast<double>(n - 3));
  return std::abs(fitted[2]) > limit * sd + bend ? std::abs(2.0 * fitted[2] / fitted[1]) : 0.0;
}

// The line through a run without its spikes.
Steady lineOf(const AnalysedStream& seen, const SteadyRun& steady, std::size_t from) {
  const auto& stream = seen.stream;
  Steady result{{}, {}, {from + steady.run.begin, from + steady.run.end}, {}, Eigen::Matrix3d::Zero()};
  if (steady.spikes.empty()) {
    result.line = fitLine(stream.timesOf(result.used), stream.valuesOf(result.used));
    result.rounding = QuantisationError{stream.timesOf(result.used), result.line, seen.steps};
    result.neighbours = neighbourProducts(stream.timesOf(result.used), stream.valuesOf(result.used), result.line);
    return result;
  }
  std::vector<double> times;
  std::vector<Eigen::Index> rows;
  for (std::size_t k = steady.run.begin; k < steady.run.end; ++k) {
    if (std::ranges::binary_search(steady.spikes, k)) {
      result.spikes.push_back(stampOf(seen.name, stream.times[from + k]));
      continue;
    }
    times.push_back(stream.times[from + k]);
    rows.push_back(static_cast<Eigen::Index>(from + k));
  }
  const Rows3 values = stream.values(rows, Eigen::all);
  result.line = fitLine(times, values);
  result.rounding = QuantisationError{times, result.line, seen.steps};
  result.neighbours = neighbourProducts(times, values, result.line);
  return result;
}

// Slip and bounce make the residuals larger than the record's own noise, or many of the samples spikes.
std::optional<Refusal> tooRough(const AnalysedStream& seen, const Steady& steady) {
  const auto dof = static_cast<double>(steady.line.n - 2);
  const double rms = std::sqrt(steady.line.scatterAlong(seen.direction) / dof);
  const double sigma = std::max(
      {seen.noise, kCaseDigits,
       localDeviation(seen.stream.timesOf(steady.used), seen.stream.along(seen.direction, steady.used), Trim::light)});
  const bool many_spikes = steady.spikes.size() > std::max<std::size_t>(1, steady.used.size() / 10);
  // The rms of one residual or two is large by chance more often.
  if (rms <= 3.0 * (1.0 + 1.0 / dof) * sigma && !many_spikes) return std::nullopt;
  return aboutTouch(seen.touch, "residual-too-large",
                    "the " + seen.name + " samples lie " + text(rms) +
                        " about the fitted line, where the record's noise is " + text(sigma) +
                        " (slip or bounce); touch again");
}

std::string stampOf(const std::string& stream, double time) {
  return stream + " at " + text(time) + " s";
}

Refusal aboutTouch(const Touch& touch, std::string name, const std::string& what) {
  return {std::move(name), touch.plan.name + ": " + what};
}

// Refuses too-few-samples (fewer than three) and gap (more than 40 % of the run, and more than two samples lost).
std::optional<Refusal> tooSparse(const AnalysedStream& seen, Run run) {
  const auto times = seen.stream.timesOf(run);
  if (times.size() < kLeastOfWindow) {
    return aboutTouch(
        seen.touch, "too-few-samples",
        std::to_string(times.size()) + " " + seen.name +
            " samples at constant speed, three are needed; retract more slowly or further, or sample faster");
  }
  double widest = 0.0;
  for (std::size_t k = 1; k < times.size(); ++k) widest = std::max(widest, times[k] - times[k - 1]);
  if (widest > std::max(0.4 * (times.back() - times.front()), kMissingPeriods * seen.usual_s)) {
    return aboutTouch(seen.touch, "gap",
                      "the " + seen.name + " samples have a gap of " + text(widest) +
                          " s during the retract; find out why samples are lost and measure again");
  }
  return std::nullopt;
}

// Fits a line to the window without ramps at its ends and without spikes. Also refuses speed-not-constant (2 %) and
// residual-too-large (slip or bounce: rms above three sd of a sample, or many spikes).
Outcome<Steady, Refusal> fitWindow(const AnalysedStream& seen, Window window) {
  if (auto bad = tooSparse(seen, window.trusted)) return *bad;
  const auto& stream = seen.stream;
  const std::size_t from = window.offered.begin;
  const SteadyRun run = steadyRun(stream.timesOf(window.offered), stream.along(seen.direction, window.offered),
                                  {window.trusted.begin - from, window.trusted.end - from}, seen.noise);
  const Run used{from + run.run.begin, from + run.run.end};
  if (auto bad = tooSparse(seen, used)) return *bad;
  const Steady steady = lineOf(seen, run, from);
  if (steady.line.n < kLeastOfWindow) return *tooSparse(seen, {used.begin, used.begin + steady.line.n});
  const double change = speedChange(stream.timesOf(used), stream.along(seen.direction, used), seen.noise,
                                    kBendOfSteps * seen.steps.maxCoeff());
  if (change > 0.02) {
    return aboutTouch(seen.touch, "speed-not-constant",
                      "the " + seen.name + " speed changes by " + text(100.0 * change) +
                          " % during the retract, 2 % are allowed; retract at constant feed, "
                          "with the override locked, and look whether the tip slips or the probe's gain bends");
  }
  if (auto bad = tooRough(seen, steady)) return *bad;
  return steady;
}

constexpr std::size_t kTrusted = RetractNeeds::kPositions;
// Fractions of the deflection at rest between which the probe's line is fitted. The lower keeps off the seating of the
// stylus; above the upper the machine still gathers speed.
constexpr double kAtRest = 0.85;
constexpr double kLowest = RetractNeeds::kLowest;
constexpr double kHighest = 0.80;
// The window of the source. All of it must lie on the line, but where the machine still gathers speed.
constexpr double kSourceLowest = 0.10;
constexpr double kSourceHighest = RetractNeeds::kHighest;
// How much of that window may miss: a spike, the guard of a cut.
constexpr double kMissing = 0.25;
// The machine's window in overtravels from its apex.
constexpr double kFrom = 0.25;
constexpr double kUntil = RetractNeeds::kUntil;
constexpr double kTrustedFrom = 0.8;
// The latest that the machine may reach its speed.
constexpr double kLatestRamp = RetractNeeds::kFrom;
// After a fast drive and a short rest the stylus still rings from the approach, and the end of a ramp hides in the
// noise: so much later, as long as the window of the source stays.
constexpr double kSettling_s = 0.004;
constexpr double kBend_s = 0.001;  // of the ramp's end, that hides in any noise
// The first line of the probe may be that much flatter than the next before the windows are looked for again.
constexpr double kBent = 0.05;
constexpr int kRounds = 3;

double usualPeriod(const Stream& stream) {
  std::vector<double> apart;
  for (std::size_t k = 1; k < stream.times.size(); ++k) apart.push_back(stream.times[k] - stream.times[k - 1]);
  return apart.empty() ? 0.0 : median(apart);
}

struct Deflected {
  Eigen::Vector3d apex;  // deflection at rest
  std::size_t last{};    // last sample near rest: the retract begins about here
  std::size_t parted{};  // first sample after it that is hardly deflected
};

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
  // Where few samples are taken neighbours tell no noise: then what the free stylus shows does.
  const double noise =
      std::min(localDeviation(touch.probe.times, deflection, Trim::heavy), deviationAboutZero(deflection));
  if (highest <= 10.0 * std::max(noise, kCaseDigits)) {
    return aboutTouch(touch, "no-contact",
                      "no clear deflection of the probe was found; check that the touch reached the surface");
  }
  const Eigen::VectorXd share = values * found.apex / found.apex.squaredNorm();
  std::optional<std::size_t> last;
  for (Eigen::Index k = 0; k < share.size(); ++k) {
    if (share[k] >= kAtRest) last = static_cast<std::size_t>(k);
  }
  // Large deflections in several directions: of a probe that repeats old samples, or one that is shaken.
  if (!last) {
    return aboutTouch(touch, "deflection-unsteady",
                      "the deflection at rest has no one direction; check probe and cable, and touch again");
  }
  found.parted = found.last = *last;
  while (found.parted < touch.probe.times.size() && share[static_cast<Eigen::Index>(found.parted)] >= kSourceLowest)
    ++found.parted;
  if (found.parted == touch.probe.times.size()) {
    return aboutTouch(touch, "truncated",
                      "the probe's record ends before the stylus leaves the surface; measure it again");
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

// The probe's line over all that falls, ramp included: to find windows with.
Outcome<Line, Refusal> roughLine(const AnalysedStream& probe, const Deflected& contact) {
  const Touch& touch = probe.touch;
  Run falling{contact.last + 1, contact.parted};
  // The last near rest may still rest; where few fall it is better than none.
  if (falling.size() < kTrusted) falling.begin = contact.last;
  if (auto bad = tooSparse(probe, falling)) return *bad;
  const Line line = fitLine(touch.probe.timesOf(falling), touch.probe.valuesOf(falling));
  if (!(line.slope.dot(contact.apex) < 0.0)) {
    return aboutTouch(touch, "deflection-not-falling",
                      "the deflection does not decrease during the retract; measure it again");
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
Outcome<Steady, Refusal> fitProbe(const AnalysedStream& probe, const Deflected& contact, const Line& rough,
                                  double highest) {
  const auto& times = probe.stream.times;
  const auto timeAt = [&](double share) {
    return rough.t_mean +
           (share * contact.apex.norm() - rough.mean.dot(probe.direction)) / rough.slope.dot(probe.direction);
  };
  const Run window = between(times, timeAt(highest), timeAt(kLowest));
  auto steady = fitWindow(probe, {window, window});
  if (!steady) return steady;
  const Run of_source = between(times, timeAt(std::min(kSourceHighest, highest)), timeAt(kSourceLowest));
  if (interrupted(probe.stream, of_source, steady->used)) {
    return aboutTouch(probe.touch, "residual-too-large",
                      "the deflection does not decrease linearly during the retract (slip or bounce); touch again");
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

// Travel at which the machine has reached its speed, mm, at the latest. It starts after its last sample at rest, and a
// ramp is as long before the time at which the line of constant speed leaves the place of rest as after it.
double rampOf(const AnalysedStream& machine, std::size_t apex, const std::vector<double>& travel,
              const Steady& steady) {
  const double latest = travel[steady.used.begin];
  const double hidden = std::max(4.0 * machine.noise, kCaseDigits);
  const auto place = [&](std::size_t k) { return travel[k] - hidden; };  // the apex is the lowest of the noise
  std::size_t at_rest = apex;
  for (std::size_t k = apex; k < steady.used.begin; ++k) {
    if (place(k) <= hidden) at_rest = k;
  }
  const double speed = steady.line.slope.norm();
  const double left = machine.stream.times[steady.used.begin] - place(steady.used.begin) / speed;
  double half = left - machine.stream.times[at_rest];
  // So much of a ramp of constant acceleration hides in the noise.
  for (int round = 0; round < 3; ++round) {
    half = left - machine.stream.times[at_rest] + std::sqrt(8.0 * hidden * std::max(half, 0.0) / speed);
  }
  return std::min(latest, half > 0.0 ? speed * half : latest);
}

struct Retreat {
  Steady steady;
  double ramp_mm{};
};

Outcome<Retreat, Refusal> fitMachine(const AnalysedStream& machine, std::size_t apex, const std::vector<double>& travel,
                                     double overtravel_mm) {
  const Touch& touch = machine.touch;
  if (*std::max_element(travel.begin() + static_cast<std::ptrdiff_t>(apex), travel.end()) < overtravel_mm) {
    return aboutTouch(touch, "truncated",
                      "the machine's record ends before the stylus can have left the surface; measure it again");
  }
  const auto last_below = [&](double limit) {
    std::size_t k = apex;
    while (k < travel.size() && travel[k] < limit) ++k;
    return k;
  };
  Window window;
  // With some of the rest, which tells how sharply the ramp bends.
  window.offered = {apex - std::min(apex, kTrusted), last_below(kUntil * overtravel_mm)};
  window.trusted = {last_below(kTrustedFrom * overtravel_mm), window.offered.end};
  if (window.trusted.size() < kTrusted) window.trusted = {last_below(kFrom * overtravel_mm), window.offered.end};
  TRY(auto steady, fitWindow(machine, window));
  const double ramp_mm = rampOf(machine, apex, travel, steady);
  const bool late = ramp_mm > kLatestRamp * overtravel_mm;
  if (late || travel[steady.used.end - 1] < overtravel_mm) {
    return aboutTouch(
        touch, "speed-not-constant",
        late ? "the machine still accelerates when the stylus leaves the surface; increase the overtravel or reduce "
               "the speed"
             : "the machine's speed changes before the stylus leaves the surface; retract further at constant feed");
  }
  return Retreat{std::move(steady), ramp_mm};
}

std::optional<Refusal> wrongMotion(const Touch& touch, const Line& machine) {
  const double speed = machine.slope.norm();
  if (machine.slope.dot(touch.plan.retract) < 0.99 * speed) {
    return aboutTouch(touch, "wrong-direction",
                      "the machine did not retract along (ux,uy,uz); correct the table of touches");
  }
  if (std::abs(speed - touch.plan.speed_mm_s) > 0.2 * touch.plan.speed_mm_s) {
    return aboutTouch(touch, "speed-differs",
                      "the machine retracts at " + text(speed) + " mm/s where " + text(touch.plan.speed_mm_s) +
                          " is stated; set the feed override to 100 %");
  }
  return std::nullopt;
}

// Both windows' lines.
struct Lines {
  Steady machine;
  Steady probe;
  Eigen::Vector3d machine_apex;
};

// Windows as a first line of the probe has them.
Outcome<Lines, Refusal> linesWithin(const AnalysedStream& machine, const AnalysedStream& probe,
                                    const Deflected& contact, const Line& first) {
  const Touch& touch = machine.touch;
  const std::vector<double> along = touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()});
  const auto apex = static_cast<std::size_t>(std::ranges::min_element(along) - along.begin());
  const std::vector<double> travel = travelOf(touch, apex);
  // Overtravel as the nominal speed and the probe's time to separation tell it: the gain need not be known.
  const double overtravel_mm = touch.plan.speed_mm_s * contact.apex.norm() / first.slope.norm();
  TRY(auto retreat, fitMachine(machine, apex, travel, overtravel_mm));
  const Line& line = retreat.steady.line;
  if (auto bad = wrongMotion(touch, line)) return *bad;
  // Where the machine reaches its speed the deflection begins to fall evenly.
  const double ramp = retreat.ramp_mm / overtravel_mm;
  const double settling = kSettling_s * line.slope.norm() / overtravel_mm;
  const double bend = kBend_s * line.slope.norm() / overtravel_mm;
  const double highest =
      std::min(kHighest, std::max(1.0 - ramp - settling, std::min(kSourceHighest, 1.0 - ramp - bend)));
  TRY(auto falling, fitProbe(probe, contact, first, highest));
  return Lines{std::move(retreat.steady), std::move(falling),
               touch.machine.values.row(static_cast<Eigen::Index>(apex))};
}

// The retract's lines from streams without spikes.
Outcome<Retract, Refusal> linesOf(const Touch& touch, const StampJitter& jitter) {
  TRY(const auto contact, findContact(touch));
  AnalysedStream probe{.touch = touch,
                       .stream = touch.probe,
                       .name = "probe",
                       .direction = contact.apex.normalized(),
                       .steps = stepsOf(touch.probe),
                       .usual_s = usualPeriod(touch.probe)};
  TRY(const auto rough, roughLine(probe, contact));
  probe.noise = std::hypot(noiseOf(touch.probe, probe.direction), jitter.probe_s * rough.slope.norm());
  const AnalysedStream machine{
      .touch = touch,
      .stream = touch.machine,
      .name = "machine",
      .direction = touch.plan.retract,
      .steps = stepsOf(touch.machine),
      .noise = std::hypot(noiseOf(touch.machine, touch.plan.retract), jitter.machine_s * touch.plan.speed_mm_s),
      .usual_s = usualPeriod(touch.machine)};
  Line first = rough;
  auto lines = linesWithin(machine, probe, contact, first);
  // A long ramp bends the first line: the next tells better where the windows are.
  for (int round = 0; round < kRounds; ++round) {
    if (!lines || first.slope.norm() > (1.0 - kBent) * lines->probe.line.slope.norm()) break;
    first = lines->probe.line;
    lines = linesWithin(machine, probe, contact, first);
  }
  if (!lines) return lines.error();
  const double falling = lines->probe.line.slope.norm();
  const Parting parting{.at_s = separationTime(lines->probe.line),
                        .fall_s = contact.apex.norm() / falling,
                        .units_per_mm = falling / lines->machine.line.slope.norm()};
  if (auto bad = notAtZero(touch, parting)) return *bad;
  std::vector<std::string> spikes = lines->machine.spikes;
  spikes.insert(spikes.end(), lines->probe.spikes.begin(), lines->probe.spikes.end());
  return Retract{.plan = touch.plan,
                 .machine = lines->machine.line,
                 .probe = lines->probe.line,
                 .machine_apex = lines->machine_apex,
                 .probe_apex = contact.apex,
                 .spikes = std::move(spikes),
                 .rounding = lines->machine.rounding,
                 .probe_rounding = lines->probe.rounding,
                 .machine_neighbours = lines->machine.neighbours,
                 .probe_neighbours = lines->probe.neighbours};
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

Outcome<Retract, Refusal> fitRetract(const Touch& touch, const StampJitter& jitter) {
  const Despiked machine = withoutSpikes(touch.machine, jitter.machine_s);
  const Despiked probe = withoutSpikes(touch.probe, jitter.probe_s);
  const Touch clean{touch.plan, machine.stream, probe.stream};
  if (auto bad = stampsJump(clean, jitter.machine_s)) return *bad;
  auto retract = linesOf(clean, jitter);
  if (!retract) return retract;
  nameSpikes(retract.value(), "machine", retract->machine, machine.removed);
  nameSpikes(retract.value(), "probe", retract->probe, probe.removed);
  if (touch.joints.size() > 0) {
    retract->joints = fitJointPath(touch.machine.times, touch.joints, touch.machine.values, retract->machine);
  }
  return retract;
}

}  // namespace probebox::metrology
