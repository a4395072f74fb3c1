#include "firmware/metrology/delay_multi_speed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/gain_matrix.hpp"
#include "firmware/metrology/size_line.hpp"
#include "firmware/metrology/touch_fit.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kKeys{"effective_diameter_mm", "feature"};
constexpr double kOutlier = 4.5;           // weighted residual of a touch
constexpr double kLeastDepthShare = 0.90;  // of the overtravel that the deflection must show

struct Selection {
  std::vector<Retract> retracts;
  std::vector<Dropped> dropped;
  std::vector<Refusal> refusals;  // of the dropped touches, in the same order
  std::size_t offered{};

  void drop(const std::string& touch, const Refusal& why) {
    std::erase_if(retracts, [&](const Retract& retract) { return retract.plan.name == touch; });
    dropped.push_back({touch, why.name});
    refusals.push_back(why);
  }
  // One bad touch among many is left out; when every other one is bad the set-up is, and its name is that of the first.
  std::optional<Refusal> tooManyDropped() const {
    if (2 * dropped.size() <= offered) return std::nullopt;
    return Refusal{refusals.front().name, refusals.front().reason + " (" + std::to_string(dropped.size()) + " of " +
                                              std::to_string(offered) + " touches cannot be used)"};
  }
};

Outcome<Selection, Refusal> select(const std::vector<Touch>& touches) {
  Selection selection;
  selection.offered = touches.size();
  for (const auto& touch : touches) {
    const auto retract = fitRetract(touch);
    if (retract) {
      selection.retracts.push_back(retract.value());
    } else if (retract.error().name == "truncated") {
      return retract.error();  // lost rows: what else is missing?
    } else {
      selection.drop(touch.plan.name, retract.error());
    }
  }
  for (const auto& noisy : noisyTouches(selection.retracts)) {
    selection.drop(noisy.name, {"residual-too-large", noisy.name + ": " + noisy.reason});
  }
  if (auto refusal = selection.tooManyDropped()) return *refusal;
  return selection;
}

std::optional<Refusal> refuseSpeedsOf(const std::vector<Retract>& retracts) {
  const auto [least, greatest] =
      std::ranges::minmax(retracts, {}, [](const Retract& retract) { return retract.machine.slope.norm(); });
  return refuseSpeeds(least.machine.slope.norm(), greatest.machine.slope.norm());
}

// A deflection that stays behind the machine's overtravel was limited by the sensor or its converter.
std::vector<std::size_t> clipped(const std::vector<Retract>& retracts, const TouchFit& fit) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < retracts.size(); ++i) {
    const auto& probe = retracts[i].probe;
    const double depth = retracts[i].machine.slope.norm() * retracts[i].probe_apex.norm() / probe.slope.norm();
    const double missing = std::abs(fit.full_depth[static_cast<Eigen::Index>(i)]);
    if (missing > (1.0 - kLeastDepthShare) * (depth + missing)) found.push_back(i);
  }
  return found;
}

struct Agreed {
  TouchFit fit;
  PooledNoise noise;
  bool common_gain{};
};

bool exceeds(double reduced_chi2, std::size_t dof, double deviations) {
  return dof > 0 && reduced_chi2 > 1.0 + deviations * std::sqrt(2.0 / static_cast<double>(dof));
}

// Fits with one gain for all touches where their slopes agree, else each touch with its own.
Outcome<Agreed, Refusal> fitOnce(const std::vector<Retract>& retracts) {
  Agreed agreed;
  agreed.noise = poolNoise(retracts);
  auto fit = fitTouches(retracts, agreed.noise, Gain::common);
  if (!fit) return fit.error();
  agreed.common_gain = !exceeds(fit->slope_chi2, 3 * retracts.size(), 6.0);
  if (!agreed.common_gain) {
    auto by_touch = fitTouches(retracts, agreed.noise, Gain::by_touch);
    if (!by_touch) return by_touch.error();
    // Outliers are looked for in both: a slip may show in the slope alone.
    for (std::size_t i = 0; i < retracts.size(); ++i) by_touch->worst[i] = std::max(by_touch->worst[i], fit->worst[i]);
    fit = std::move(by_touch);
  }
  agreed.fit = std::move(fit).value();
  return agreed;
}

// Leaves out the touch that disagrees most, as long as one does: it pulls others along, so one at a time. When a fifth
// is gone and there is no agreement yet the model is at fault, not the touches: then all stay, and the sd tells.
Agreed withoutOutliers(Selection& selection, Agreed all) {
  Selection kept = selection;
  Agreed agreed = all;
  while (true) {
    const auto worst = std::ranges::max_element(agreed.fit.worst);
    if (*worst <= kOutlier) break;
    const std::string name = kept.retracts[static_cast<std::size_t>(worst - agreed.fit.worst.begin())].plan.name;
    kept.drop(name, {"residual-too-large", name + ": does not agree with the other touches (slip, dirt); touch again"});
    if (5 * (kept.dropped.size() - selection.dropped.size()) > selection.offered) return all;
    if (kept.tooManyDropped() || refuseSpeedsOf(kept.retracts)) return all;
    auto next = fitOnce(kept.retracts);
    if (!next) return all;
    agreed = std::move(next).value();
  }
  selection = std::move(kept);
  return agreed;
}

Outcome<Agreed, Refusal> agree(Selection& selection) {
  auto first = fitOnce(selection.retracts);
  if (!first) return first;
  std::vector<std::string> clipped_names;
  for (const auto i : clipped(selection.retracts, first->fit)) clipped_names.push_back(selection.retracts[i].plan.name);
  if (!clipped_names.empty()) {
    for (const auto& name : clipped_names) {
      selection.drop(name,
                     {"clipped", name + ": the deflection stays behind the overtravel by more than 10 %; reduce the "
                                        "overtravel or the gain"});
    }
    if (auto refusal = selection.tooManyDropped()) return *refusal;
    if (auto refusal = refuseSpeedsOf(selection.retracts)) return *refusal;
    first = fitOnce(selection.retracts);
    if (!first) return first;
  }
  return withoutOutliers(selection, std::move(first).value());
}

// Sizes at the nominal speeds, for a picture of the line of (A10).
void addSizes(Result& result, const std::vector<Retract>& retracts, const TouchFit& fit) {
  std::map<double, std::vector<double>> sizes;
  for (std::size_t i = 0; i < retracts.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double size = fit.size_mm + 2.0 * (fit.radial[row] - fit.tau_s * fit.normal_speed[row]);
    sizes[retracts[i].plan.speed_mm_s].push_back(size);
  }
  std::vector<double> speeds;
  std::vector<double> means;
  for (const auto& [speed, of_speed] : sizes) {
    speeds.push_back(speed);
    double sum = 0.0;
    for (const double size : of_speed) sum += size;
    means.push_back(sum / static_cast<double>(of_speed.size()));
  }
  result.also.push_back(Estimate::vector("speeds_mm_s", speeds, {}));
  result.also.push_back(Estimate::vector("sizes_mm", means, {}));
}

void addGainMatrix(Result& result, const std::vector<Retract>& retracts) {
  Eigen::MatrixX3d velocities{static_cast<Eigen::Index>(retracts.size()), 3};
  Eigen::MatrixX3d slopes{static_cast<Eigen::Index>(retracts.size()), 3};
  for (std::size_t i = 0; i < retracts.size(); ++i) {
    velocities.row(static_cast<Eigen::Index>(i)) = retracts[i].machine.slope.transpose();
    slopes.row(static_cast<Eigen::Index>(i)) = retracts[i].probe.slope.transpose();
  }
  const auto gain = gainMatrix(velocities, slopes);
  if (!gain) return;
  const auto entries = gain->reshaped<Eigen::RowMajor>();
  result.also.push_back(Estimate::matrix("gain_matrix", 3, {entries.begin(), entries.end()}, {}));
}

void addWarnings(Result& result, const Selection& selection, const Agreed& agreed) {
  for (const auto& refusal : selection.refusals) result.warnings.push_back("dropped: " + refusal.reason);
  if (!agreed.common_gain) {
    result.warnings.emplace_back("the probe's gain differs between touches: each was extrapolated by its own slope");
  }
  for (const auto& retract : selection.retracts) {
    const double speed = retract.machine.slope.norm();
    if (std::abs(speed - retract.plan.speed_mm_s) <= 0.02 * retract.plan.speed_mm_s) continue;
    result.warnings.push_back(retract.plan.name + " ran at " + text(speed) + " mm/s, not " +
                              text(retract.plan.speed_mm_s) + ": is the feed override at 100 %?");
  }
}

Result report(const Dataset& dataset, const Selection& selection, const Agreed& agreed,
              std::optional<double> known_size) {
  const TouchFit& fit = agreed.fit;
  // The touches agree worse than their samples promise: repeatability of surface and machine. Believe the touches.
  const bool widened = exceeds(fit.radial_chi2, fit.dof, 4.0);
  const double scale = widened ? fit.radial_chi2 : 1.0;
  const double tau_sd = std::sqrt(fit.covariance(0, 0) * scale);
  const double size_sd = std::sqrt(fit.covariance(1, 1) * scale);

  Result result;
  result.method = dataset.method;
  result.convention = "tau = machine delay - probe delay; positive: the machine's stamps are late (M = P - tau v)";
  result.estimates.push_back(Estimate::scalar("tau_s", fit.tau_s, tau_sd));
  result.estimates.push_back(Estimate::scalar("effective_diameter_mm", fit.size_mm, size_sd));
  if (known_size) {
    result.estimates.push_back(Estimate::scalar("static_error_mm", fit.size_mm - *known_size, size_sd));
  }
  if (fit.centre.size() == 3) {
    result.also.push_back(Estimate::vector("centre_mm", {fit.centre.begin(), fit.centre.end()},
                                           {fit.centre_sd.begin(), fit.centre_sd.end()}));
  }
  addGainMatrix(result, selection.retracts);
  addSizes(result, selection.retracts, fit);
  result.rms = std::sqrt(fit.radial.squaredNorm() / static_cast<double>(fit.radial.size()));
  result.dof = agreed.noise.dof;
  result.condition = fit.condition;
  if (fit.dof > 0) result.chi2_reduced = fit.radial_chi2;
  result.covariance = Covariance{{"tau_s", "effective_diameter_mm"},
                                 {fit.covariance(0, 0) * scale, fit.covariance(0, 1) * scale,
                                  fit.covariance(1, 0) * scale, fit.covariance(1, 1) * scale}};
  result.warnings = unusedKeys(dataset, kKeys);
  addWarnings(result, selection, agreed);
  if (widened) {
    result.warnings.push_back("the touches agree worse than their samples promise (reduced chi-square " +
                              text(fit.radial_chi2) + "): sd widened; look for dirt, stiction or a loose stylus");
  }
  result.dropped = selection.dropped;
  return result;
}

}  // namespace

Outcome<Result, Refusal> solveDelayMultiSpeed(const Dataset& dataset) {
  const auto known_size = configPositive(dataset, "effective_diameter_mm");
  if (!known_size) return known_size.error();
  const auto listed = checkedTable(dataset, "touches", kTouchesColumns);
  if (!listed) return listed.error();
  const auto [slowest, fastest] = std::ranges::minmax(*listed.value()->column("speed_mm_s"));
  if (slowest > 0.0) {
    if (auto refusal = refuseSpeeds(slowest, fastest)) return *refusal;
  }
  const auto touches = readTouches(dataset);
  if (!touches) return touches.error();
  auto selection = select(touches.value());
  if (!selection) return selection.error();
  if (auto refusal = refuseSpeedsOf(selection->retracts)) return *refusal;
  const auto agreed = agree(selection.value());
  if (!agreed) return agreed.error();
  return report(dataset, selection.value(), agreed.value(), known_size.value());
}

}  // namespace probebox::metrology
