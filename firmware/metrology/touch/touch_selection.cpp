#include "firmware/metrology/touch/touch_selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

// Places of the machine where the deflection rises through a level and where it falls through it, the delay taken out:
// one place, whatever the gain is.
struct TwoPlaces {
  std::string touch;
  double speed_mm_s{};  // stated
  double apart_mm{};    // the place on the way in minus that on the way out
  double noise_mm{};    // its sd by the samples
  double overtravel_mm{};
  double mm_per_s{};  // by which a second of delay parts them
  double period_s{};  // of the machine's samples
};

constexpr double kLevelOfRest = 0.7;  // of the deflection at rest: what bounced at contact has faded
constexpr double kApartDeviations = 5.0;
constexpr double kApartShare = 0.05;     // of the overtravel
constexpr double kApartPeriods = 0.25;   // of the machine's samples: lines between them cut corners
constexpr double kLeastApproach = 0.05;  // of the speed of the retract
constexpr double kOwnShare = 0.02;       // of the overtravel, by which touches of one speed may differ

struct Passing {
  double value{};
  double rate{};  // per s
};

// By a line between the samples beside a time; none beyond the record and across gaps.
std::optional<Passing> passingAt(const Signal& signal, double t) {
  const auto after = std::ranges::upper_bound(signal.times, t) - signal.times.begin();
  if (after == 0 || after == std::ssize(signal.times)) return std::nullopt;
  const auto k = static_cast<std::size_t>(after);
  const double interval = signal.times[k] - signal.times[k - 1];
  if (interval > kGapPeriods * signal.period()) return std::nullopt;
  const double rate = (signal.values[k] - signal.values[k - 1]) / interval;
  return Passing{signal.values[k - 1] + rate * (t - signal.times[k - 1]), rate};
}

// When the deflection rises through the level, and when it falls through it for good.
struct Stay {
  double from_s{};
  double until_s{};
};

std::optional<Stay> stayAbove(const Signal& share, double level) {
  const auto& values = share.values;
  const auto above = [&](double one) { return one >= level; };
  const auto first = static_cast<std::size_t>(std::ranges::find_if(values, above) - values.begin());
  std::size_t last = values.size();
  while (last > 0 && !above(values[last - 1])) --last;
  if (first == 0 || last <= first || last == values.size()) return std::nullopt;
  const auto crossing = [&](std::size_t k) {
    const double way = (level - values[k - 1]) / (values[k] - values[k - 1]);
    return share.times[k - 1] + way * (share.times[k] - share.times[k - 1]);
  };
  const double allowed = kGapPeriods * share.period();
  if (share.times[first] - share.times[first - 1] > allowed || share.times[last] - share.times[last - 1] > allowed)
    return std::nullopt;
  return Stay{crossing(first), crossing(last)};
}

// tau_s: the delay along the retract. Nothing where the approach is not in the record.
std::optional<TwoPlaces> twoPlaces(const Touch& touch, const Retract& retract, double tau_s) {
  const Stream machine = withoutSpikes(touch.machine, 0.0).stream;
  const Stream probe = withoutSpikes(touch.probe, 0.0).stream;
  const Signal place{machine.times, machine.along(touch.plan.retract, {0, machine.times.size()})};
  const Eigen::Vector3d apex = retract.probe_apex;
  const auto stay =
      stayAbove({probe.times, probe.along(apex / apex.squaredNorm(), {0, probe.times.size()})}, kLevelOfRest);
  if (!stay) return std::nullopt;
  const auto in = passingAt(place, stay->from_s + tau_s);
  const auto out = passingAt(place, stay->until_s + tau_s);
  const double speed = retract.machine.slope.norm();
  if (!in || !out || in->rate > -kLeastApproach * speed || out->rate <= 0.0) return std::nullopt;
  const double falling = retract.probe.slope.norm();
  const double of_probe_mm = noiseOf(probe, apex.normalized()) / falling * speed;
  const double still_mm = noiseOf(machine, touch.plan.retract);
  return TwoPlaces{.touch = touch.plan.name,
                   .speed_mm_s = touch.plan.speed_mm_s,
                   .apart_mm = in->value - out->value,
                   .noise_mm = std::hypot(std::sqrt(2.0) * still_mm, std::sqrt(2.0) * of_probe_mm),
                   .overtravel_mm = speed * apex.norm() / falling,
                   .mm_per_s = out->rate - in->rate,
                   .period_s = place.period()};
}

// Refuses clocks-differ: the clock of one stream runs at another rate, or its stamps jump at rest.
std::optional<Refusal> clocksDiffer(const TwoPlaces& places, double sd_delay_s) {
  const double sd = std::hypot(places.noise_mm, sd_delay_s * places.mm_per_s);
  const double allowed =
      kApartDeviations * sd + kApartShare * places.overtravel_mm + kApartPeriods * places.period_s * places.mm_per_s;
  if (std::abs(places.apart_mm) <= allowed) return std::nullopt;
  return Refusal{"clocks-differ",
                 places.touch + ": by the delay that was found the machine stands " + text(std::abs(places.apart_mm)) +
                     " mm apart where the deflection rises and where it falls through the same level; check that "
                     "machine and probe have stamps of one clock, and the stated size"};
}

// Warns of two touches of one speed whose places are apart differently: what is common to all cancels, so that less
// shows than one touch could tell.
std::optional<std::string> ownDelays(const std::vector<TwoPlaces>& touches) {
  for (const auto& one : touches) {
    for (const auto& other : touches) {
      if (other.speed_mm_s != one.speed_mm_s) continue;
      const double off_mm = one.apart_mm - other.apart_mm;
      if (off_mm <= kApartDeviations * std::hypot(one.noise_mm, other.noise_mm) + kOwnShare * one.overtravel_mm)
        continue;
      return one.touch + " and " + other.touch + ": by their ways in and out their delays differ by " +
             text(off_mm / one.mm_per_s) +
             " s: check that machine and probe have the same touches and one clock, and that all axes have one delay";
    }
  }
  return std::nullopt;
}

constexpr double kLeastDepthShare = 0.90;  // of the overtravel that the deflection must show

// The noise that chi-square is counted in is known from so many residuals itself.
bool exceeds(double reduced_chi2, std::size_t dof, const PooledNoise& noise, double deviations) {
  if (dof == 0 || noise.least_dof == 0) return false;
  const double variance = 2.0 / static_cast<double>(dof) + 2.0 / static_cast<double>(noise.least_dof);
  return reduced_chi2 > 1.0 + deviations * std::sqrt(variance);
}

double depthOf(const Retract& retract) {
  return retract.machine.slope.norm() * retract.probe_apex.norm() / retract.probe.slope.norm();
}

struct Selection {
  const TouchQuestion& question;
  AgreedTouches touches{};
  std::size_t offered{};
  std::size_t unknowns{};

  void drop(const std::string& touch, const Refusal& why) {
    std::erase_if(touches.retracts, [&](const Retract& retract) { return retract.plan.name == touch; });
    touches.dropped.push_back({touch, why.name});
    touches.refusals.push_back(why);
  }
  // One bad touch among many is left out; when every other one is bad the set-up is, and its name is the one that most
  // of them have. So it is when what is left could hide another bad one.
  std::optional<Refusal> tooManyDropped() const {
    const auto& refusals = touches.refusals;
    if (refusals.empty()) return std::nullopt;
    if (2 * refusals.size() <= offered && touches.retracts.size() > unknowns) return std::nullopt;
    const auto occurs = [&](const Refusal& one) { return std::ranges::count(refusals, one.name, &Refusal::name); };
    const Refusal& usual = *std::ranges::max_element(refusals, {}, occurs);
    return Refusal{usual.name, usual.reason + " (" + std::to_string(refusals.size()) + " of " +
                                   std::to_string(offered) + " touches cannot be used)"};
  }
  std::optional<Refusal> refuseSpeedsLeft() const {
    if (question.size_mm) return std::nullopt;
    const auto [least, greatest] =
        std::ranges::minmax(touches.retracts, {}, [](const Retract& retract) { return retract.machine.slope.norm(); });
    return refuseSpeeds(least.machine.slope.norm(), greatest.machine.slope.norm());
  }
  std::optional<Refusal> insufficient() const {
    if (auto refusal = tooManyDropped()) return refusal;
    return refuseSpeedsLeft();
  }
};

std::size_t unknownsOf(const std::vector<Touch>& touches, const TouchQuestion& question) {
  Eigen::MatrixXd normals{static_cast<Eigen::Index>(touches.size()), 3};
  for (std::size_t i = 0; i < touches.size(); ++i) {
    normals.row(static_cast<Eigen::Index>(i)) = touches[i].plan.normal.transpose();
  }
  return static_cast<std::size_t>(spanOf(normals).cols() + question.delayCount() + (question.size_mm ? 0 : 1));
}

Outcome<Selection, Refusal> select(const std::vector<Touch>& touches, const TouchQuestion& question) {
  Selection selection{.question = question, .offered = touches.size(), .unknowns = unknownsOf(touches, question)};
  const StampJitter jitter = stampJitter(touches);
  for (const auto& touch : touches) {
    const auto retract = fitRetract(touch, jitter);
    if (retract) {
      selection.touches.retracts.push_back(retract.value());
    } else if (retract.error().name == "truncated") {
      return retract.error();  // lost rows: what else is missing?
    } else {
      selection.drop(touch.plan.name, retract.error());
    }
  }
  for (const auto& noisy : noisyTouches(selection.touches.retracts)) {
    selection.drop(noisy.name, {"residual-too-large", noisy.name + ": " + noisy.reason});
  }
  if (auto refusal = selection.insufficient()) return *refusal;
  if (auto refusal = tooFewResiduals(selection.touches.retracts)) return *refusal;
  return selection;
}

// Fits with one gain for all touches where their slopes agree, else each touch with its own.
std::optional<Refusal> fitOnce(Selection& selection) {
  AgreedTouches& touches = selection.touches;
  TouchQuestion question = selection.question;
  touches.noise = poolNoise(touches.retracts);
  question.gain = Gain::common;
  TRY(auto fit, fitTouches(touches.retracts, touches.noise, question));
  touches.gain_misfit = fit.slope_chi2;
  touches.common_gain = !exceeds(fit.slope_chi2, fit.slope_dof, touches.noise, 6.0);
  if (!touches.common_gain) {
    question.gain = Gain::by_touch;
    TRY(auto by_touch, fitTouches(touches.retracts, touches.noise, question));
    // Outliers are looked for in both: a slip may show in the slope alone.
    for (std::size_t i = 0; i < by_touch.worst.size(); ++i) {
      by_touch.worst[i] = std::max(by_touch.worst[i], fit.worst[i]);
    }
    fit = std::move(by_touch);
  }
  touches.fit = std::move(fit);
  return std::nullopt;
}

std::vector<std::string> clipped(const AgreedTouches& touches) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < touches.retracts.size(); ++i) {
    const double missing = std::abs(touches.fit.full_depth[static_cast<Eigen::Index>(i)]);
    if (isClipped(missing, depthOf(touches.retracts[i]))) found.push_back(touches.retracts[i].plan.name);
  }
  return found;
}

std::optional<Refusal> dropClipped(Selection& selection) {
  const auto names = clipped(selection.touches);
  if (names.empty()) return std::nullopt;
  for (const auto& name : names) selection.drop(name, clippedTouch(name));
  if (auto refusal = selection.insufficient()) return refusal;
  return fitOnce(selection);
}

// Leaves out the touch that disagrees most, as long as one does: it pulls others along, so one at a time. When a fifth
// is gone and there is no agreement yet the model is at fault, not the touches: then all stay, and the sd tells.
void dropOutliers(Selection& selection) {
  Selection kept = selection;
  while (true) {
    const auto& worst = kept.touches.fit.worst;
    const auto largest = std::ranges::max_element(worst);
    if (*largest <= kOutlierDeviations) break;
    const std::string name = kept.touches.retracts[static_cast<std::size_t>(largest - worst.begin())].plan.name;
    kept.drop(name, {"residual-too-large", name + ": " + std::string{kDisagrees}});
    if (5 * (kept.touches.dropped.size() - selection.touches.dropped.size()) > selection.offered) return;
    if (kept.insufficient() || fitOnce(kept)) return;
  }
  selection.touches = std::move(kept.touches);
}

// By the delay of all; none for delays of joints.
std::vector<TwoPlaces> placesOf(const Selection& selection, const std::vector<Touch>& touches) {
  std::vector<TwoPlaces> all;
  if (selection.question.delays == Delays::each_joint) return all;
  const Eigen::VectorXd& tau_s = selection.touches.fit.tau_s;
  for (const auto& retract : selection.touches.retracts) {
    const Eigen::Vector3d squares = retract.plan.retract.cwiseAbs2();
    const double along_s = tau_s.size() == 1 ? tau_s[0] : tau_s.head<3>().dot(squares);
    const auto touch =
        std::ranges::find_if(touches, [&](const Touch& one) { return one.plan.name == retract.plan.name; });
    if (auto places = twoPlaces(*touch, retract, along_s)) all.push_back(std::move(*places));
  }
  return all;
}

// Leaves out touches whose streams have clocks of their own, by the delay of all; those that stay may warn.
std::optional<Refusal> dropOtherClocks(Selection& selection, const std::vector<Touch>& touches) {
  const AgreedTouches& agreed = selection.touches;
  const double variance = agreed.fit.covariance.diagonal().head(agreed.fit.tau_s.size()).maxCoeff() * agreed.widening();
  bool dropped = false;
  auto places = placesOf(selection, touches);
  for (const auto& of_touch : places) {
    const auto refusal = clocksDiffer(of_touch, std::sqrt(variance));
    if (!refusal) continue;
    selection.drop(of_touch.touch, *refusal);
    dropped = true;
  }
  if (dropped) {
    if (auto refusal = selection.insufficient()) return refusal;
    if (auto refusal = fitOnce(selection)) return refusal;
    places = placesOf(selection, touches);
  }
  selection.touches.own_delays = ownDelays(places);
  return std::nullopt;
}

// A disagreement that is no longer a matter of micrometres is not answered with a wide sd.
std::optional<Refusal> grossMisfit(const AgreedTouches& touches) {
  for (std::size_t i = 0; i < touches.retracts.size(); ++i) {
    const double misses_mm = std::abs(touches.fit.radial[static_cast<Eigen::Index>(i)]);
    if (touches.fit.worst[i] <= kOutlierDeviations || misses_mm <= kGrossShare * depthOf(touches.retracts[i])) continue;
    return Refusal{
        "residual-too-large",
        touches.retracts[i].plan.name + " misses the feature by " + text(misses_mm) +
            " mm: check for slip, dirt, a drift between the touches, a wrong size or a loose stylus, and touch "
            "again"};
  }
  return std::nullopt;
}

}  // namespace

bool isClipped(double missing_mm, double depth_mm) {
  return missing_mm > (1.0 - kLeastDepthShare) * (depth_mm + missing_mm);
}

Refusal clippedTouch(const std::string& name) {
  return {
      "clipped",
      name +
          ": the deflection is more than 10 % off the overtravel; reduce the overtravel or the gain where the probe "
          "is at its limit, or correct the stated size, the positions and the stamps"};
}

NoiseCheck AgreedTouches::noiseCheck() const {
  return checkNoise(fit.radial_chi2, {.dof = fit.dof, .noise_dof = noise.least_dof}, fit.radial);
}

double AgreedTouches::widening() const {
  const double factor = noiseCheck().widening;
  return factor * factor;
}

Outcome<AgreedTouches, Refusal> agreeOn(const std::vector<Touch>& touches, const TouchQuestion& question) {
  TRY(auto selection, select(touches, question));
  if (auto refusal = fitOnce(selection)) return *refusal;
  if (auto refusal = dropClipped(selection)) return *refusal;
  dropOutliers(selection);
  if (auto refusal = dropOtherClocks(selection, touches)) return *refusal;
  if (auto refusal = grossMisfit(selection.touches)) return *refusal;
  return std::move(selection.touches);
}

namespace {

// Those that are kept, and what the delays move each by.
struct KeptTouches {
  std::vector<Touch> touches;
  WholeRecordQuestion question;
};

KeptTouches keptOf(const AgreedTouches& agreed, std::span<const Touch> recorded, const TouchQuestion& question) {
  KeptTouches kept;
  const auto count = static_cast<Eigen::Index>(agreed.retracts.size());
  kept.question.lost_mm = question.lost_mm;
  kept.question.shape = question.shape;
  kept.question.carried.resize(count, question.delayCount());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Retract& retract = agreed.retracts[static_cast<std::size_t>(i)];
    kept.touches.push_back(*std::ranges::find(recorded, retract.plan.name, [](const Touch& t) { return t.plan.name; }));
    const Eigen::Vector3d& along = retract.plan.retract;
    kept.question.carried.row(i) = along.transpose() *
                                   dPointPerDelay(retract, question, separationTime(retract.probe), agreed.fit.tau_s) /
                                   along.dot(retract.machine.slope);
  }
  return kept;
}

// Puts what the whole records tell in the place of what the retracts told.
void takeOver(AgreedTouches& agreed, WholeRecord whole) {
  TouchFit& fit = agreed.fit;
  const Eigen::Index delays = whole.tau_s.size(), centre = whole.centre.size();
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < delays; ++k) rows.push_back(k);
  for (Eigen::Index k = 0; k < centre + 1; ++k) rows.push_back(whole.centreAt() + k);
  fit.tau_s = whole.tau_s;
  fit.size_mm = whole.size_mm;
  fit.covariance = whole.covariance(rows, rows);
  fit.per_shift = whole.per_shift(rows, Eigen::all);
  fit.centre = whole.centre;
  fit.centre_sd = fit.covariance.diagonal().segment(delays, centre).cwiseSqrt();
  fit.radial = whole.off_mm;
  fit.worst = whole.worst;
  fit.condition = whole.condition;
  fit.dof = whole.chi2_dof;
  fit.radial_chi2 = whole.chi2_reduced;
  agreed.noise.dof = agreed.noise.least_dof = whole.noise_dof;
  agreed.noise.warnings = whole.warnings;
  agreed.whole = std::move(whole);
}

void leaveOut(AgreedTouches& agreed, std::size_t at, const Refusal& why) {
  agreed.dropped.push_back({agreed.retracts[at].plan.name, why.name});
  agreed.refusals.push_back(why);
  agreed.retracts.erase(agreed.retracts.begin() + static_cast<std::ptrdiff_t>(at));
  auto& speeds = agreed.fit.normal_speed;
  const auto row = static_cast<Eigen::Index>(at);
  const Eigen::VectorXd after = speeds.tail(speeds.size() - row - 1);
  speeds.conservativeResize(speeds.size() - 1);
  speeds.tail(after.size()) = after;
}

}  // namespace

AgreedTouches onWholeRecords(AgreedTouches agreed, std::span<const Touch> recorded, const TouchQuestion& question) {
  const std::size_t offered = recorded.size();
  const auto fitted = [&](const AgreedTouches& of) {
    const auto kept = keptOf(of, recorded, question);
    return fitWholeRecord(kept.touches, kept.question);
  };
  auto whole = fitted(agreed);
  if (!whole) {
    agreed.noise.warnings.push_back("retract-only: the ways in and out do not tell the delay together (" +
                                    whole.error().reason +
                                    "): the ways out alone do, with a known size or at several speeds");
    return agreed;
  }
  // Joints with delays of their own bend the path of the tip: where that shows, no line of the way in fits that of the
  // way out, and the retracts tell more.
  const auto uncertainty = [&](const Eigen::MatrixXd& covariance) {
    return covariance.diagonal().head(question.delayCount()).maxCoeff();
  };
  if (question.delays == Delays::each_joint && uncertainty(whole->covariance) > uncertainty(agreed.fit.covariance))
    return agreed;
  // A touch that cannot be read on its whole record is of no use; one that disagrees pulls others along.
  AgreedTouches kept = agreed;
  auto best = whole;
  while (best) {
    const auto& worst = best->worst;
    const auto unread = std::ranges::find(worst, std::numeric_limits<double>::infinity());
    const auto largest = unread != worst.end() ? unread : std::ranges::max_element(worst);
    if (*largest <= kOutlierDeviations) {
      takeOver(kept, std::move(best).value());
      return kept;
    }
    if (5 * (kept.dropped.size() - agreed.dropped.size() + 1) > offered) break;
    const auto at = static_cast<std::size_t>(largest - worst.begin());
    leaveOut(kept, at, {"residual-too-large", kept.retracts[at].plan.name + ": " + std::string{kDisagrees}});
    best = fitted(kept);
  }
  // No agreement without many of them: the model is at fault, and the sd tells.
  takeOver(agreed, std::move(whole).value());
  return agreed;
}

}  // namespace probebox::metrology
