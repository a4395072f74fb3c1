#include "firmware/metrology/touch/touch_delay.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/touch/dwell_ringing.hpp"
#include "firmware/metrology/touch/gain_matrix.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kFeatures{"external", "internal"};

std::string delayKey(const TouchQuestion& question) {
  switch (question.delays) {
    case Delays::common:
      return std::string{quantity::kTau};
    case Delays::each_axis:
      return std::string{quantity::kTauAxis};
    case Delays::each_joint:
      return std::string{quantity::kTauJoint};
  }
  return {};
}

// The table of touches may tell that the speeds do not suffice before any sample is looked at.
std::optional<Refusal> refuseStatedSpeeds(const Table& touches) {
  const auto [slowest, fastest] = std::ranges::minmax(*touches.column(column::kSpeed));
  return slowest > 0.0 ? refuseSpeeds(slowest, fastest) : std::nullopt;
}

// The normals tell inside from outside; what is stated must not contradict them.
std::optional<Refusal> wrongFeature(const std::optional<std::string>& stated, const TouchFit& fit) {
  const bool external = fit.normal_speed.sum() > 0.0;
  if (!stated || (*stated == "external") == external) return std::nullopt;
  return Refusal{"bad-config", "feature is '" + *stated + "', but the touches retract " +
                                   (external ? "outwards as from an external" : "inwards as from an internal") +
                                   " one: correct the configuration or the normals"};
}

// The delay that the touches along one axis tell, and its sd; nothing where they are too few or disagree.
struct AxisDelay {
  double tau_s{};
  double sd_s{};
};
std::optional<AxisDelay> delayAlong(Eigen::Index axis, const std::vector<Touch>& touches,
                                    const TouchQuestion& question) {
  constexpr double kAlong = 0.9;  // 26 degrees
  std::vector<Touch> along;
  for (const auto& touch : touches) {
    if (std::abs(touch.plan.normal[axis]) > kAlong) along.push_back(touch);
  }
  if (along.size() < 2) return std::nullopt;
  const auto agreed = agreeOn(along, question);
  if (!agreed || !agreed->dropped.empty()) return std::nullopt;
  return AxisDelay{agreed->fit.tau_s[0], std::sqrt(agreed->fit.covariance(0, 0) * agreed->widening())};
}

// What contradicts one delay for all axes may be touches of axes with delays of their own, and no touch is at fault.
Outcome<AgreedTouches, Refusal> agreeOrNameAxes(const std::vector<Touch>& touches, const TouchQuestion& question) {
  constexpr double kMostSd = 6;
  constexpr std::array<std::string_view, 4> kOfOneDelay{"clipped", "clocks-differ", "residual-too-large", "tip-slip"};
  auto agreed = agreeOn(touches, question);
  if (agreed || question.delays != Delays::common) return agreed;
  if (std::ranges::find(kOfOneDelay, agreed.error().name) == kOfOneDelay.end()) return agreed;
  std::string told;
  std::vector<AxisDelay> delays;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto delay = delayAlong(axis, touches, question);
    if (!delay) continue;
    delays.push_back(*delay);
    told +=
        std::string{told.empty() ? "" : ", "} + "XYZ"[axis] + " " + text(std::round(delay->tau_s * 1e6) / 1e3) + " ms";
  }
  if (delays.size() < 2) return agreed;
  const auto [least, most] = std::ranges::minmax(delays, {}, &AxisDelay::tau_s);
  if (most.tau_s - least.tau_s <= kMostSd * std::hypot(most.sd_s, least.sd_s)) return agreed;
  return Refusal{"axes-delays-differ",
                 "the touches contradict one delay of all axes, and those along each axis agree "
                 "with one of its own: " +
                     told +
                     ": solve and calibrate delay-per-axis, and look why the stamps of the axes "
                     "are not equally late; of an axis with two touches it may be a slip or dirt at one of them: touch "
                     "again"};
}

struct DroppedAlike {
  std::string why;  // behind the name of the touch
  std::vector<std::string> names;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of the normals
};

// Touches of one place that differ alike at every speed did not slip: what repeats is form.
bool isFormOfASide(const DroppedAlike& group, const std::vector<TouchPlan>& plans) {
  if (group.why != kDisagrees || group.names.size() < 2) return false;
  const Eigen::Vector3d side = group.sum.normalized();
  const auto is_there = [&](const TouchPlan& plan) { return plan.normal.dot(side) > kSameSideCosine; };
  const auto is_dropped = [&](const TouchPlan& plan) {
    return std::ranges::find(group.names, plan.name) != group.names.end();
  };
  return std::ranges::all_of(plans, [&](const TouchPlan& plan) { return is_there(plan) == is_dropped(plan); });
}

std::string sideInWords(const Eigen::Vector3d& sum) {
  const Eigen::Vector3d side = sum.normalized();
  Eigen::Index axis = 0;
  const double most = side.cwiseAbs().maxCoeff(&axis);
  const auto round = [](double part) { return text(std::round(part * 100) / 100); };
  if (most > 0.99) return std::string{side[axis] < 0 ? "-" : "+"} + "XYZ"[axis];
  return "(" + round(side[0]) + ", " + round(side[1]) + ", " + round(side[2]) + ")";
}

// One warning for all touches that were dropped for one reason.
std::vector<std::string> droppedInWords(const std::vector<Refusal>& refusals, const std::vector<Dropped>& dropped,
                                        const std::vector<TouchPlan>& plans) {
  std::vector<DroppedAlike> groups;
  for (std::size_t k = 0; k < refusals.size(); ++k) {
    const auto& name = dropped[k].name;
    const bool is_named = refusals[k].reason.starts_with(name + ": ");
    const std::string why = is_named ? refusals[k].reason.substr(name.size() + 2) : refusals[k].reason;
    auto group = std::ranges::find(groups, why, &DroppedAlike::why);
    if (group == groups.end()) group = groups.insert(groups.end(), {why, {}});
    group->names.push_back(name);
    const auto plan = std::ranges::find(plans, name, &TouchPlan::name);
    if (plan != plans.end()) group->sum += plan->normal;
  }
  std::vector<std::string> all;
  for (const auto& group : groups) {
    std::string names;
    for (const auto& name : group.names) names += (names.empty() ? "" : ", ") + name;
    all.push_back("dropped: " + names + ": " +
                  (isFormOfASide(group, plans)
                       ? "all of the " + sideInWords(group.sum) +
                             " side: the sides contradict one another, alike at every touch, which is lobing of the "
                             "probe, form of the sphere or dirt on it, at this side or at another; touching again "
                             "changes nothing, machine-check measures it"
                       : group.why));
  }
  return all;
}

// Rows of a gain are machine axes: those of a probe at A are turned against those at A = 0.
Eigen::Matrix3d turnedBack(double spindle_rad) {
  return Eigen::AngleAxisd{-spindle_rad, Eigen::Vector3d::UnitZ()}.toRotationMatrix();
}

}  // namespace

Outcome<TouchDelay, Refusal> TouchDelay::measure(const Dataset& dataset, TouchQuestion question) {
  TRY(const auto lost, configNumber(dataset, quantity::kLostMotion.key));
  question.lost_mm = lost.value_or(0);
  TRY(const auto feature, configWord(dataset, "feature", kFeatures));
  TRY(const auto previous, previousDelay(dataset, "previous_" + delayKey(question), question.delayCount()));
  TRY(const auto spindle_rad, spindleOfProbe(dataset));
  TRY(const auto listed, checkedTable(dataset, "touches", kTouchesColumns));
  if (!question.size_mm) {
    if (auto refusal = refuseStatedSpeeds(*listed)) return *refusal;
  }
  TRY(const auto touches, question.kinematics ? readJointTouches(dataset, *question.kinematics) : readTouches(dataset));
  // Where the speeds tell the size, touches are judged without the stated one, which may be what is wrong; with it
  // where they are too few for that.
  TouchQuestion sizeless = question;
  sizeless.size_mm.reset();
  const auto usable = withoutRinging(touches);
  auto judged = refuseStatedSpeeds(*listed) ? agreeOrNameAxes(usable, question) : agreeOrNameAxes(usable, sizeless);
  if (!judged && question.size_mm) judged = agreeOrNameAxes(usable, question);
  TRY(auto agreed, std::move(judged));
  if (auto refusal = wrongFeature(feature, agreed.fit)) return *refusal;
  agreed = onWholeRecords(std::move(agreed), touches, question);
  std::vector<TouchPlan> plans;
  for (const auto& touch : touches) plans.push_back(touch.plan);
  return TouchDelay{dataset, question, std::move(agreed), std::move(plans), previous, spindle_rad};
}

std::vector<double> TouchDelay::perShift(Eigen::Index first, Eigen::Index rows) const {
  const Eigen::MatrixXd changes = touches_.fit.per_shift.middleRows(first, rows);
  const auto by_value = changes.reshaped<Eigen::RowMajor>();
  return {by_value.begin(), by_value.end()};
}

Estimate TouchDelay::delay() const {
  const Eigen::VectorXd tau = previous_ + touches_.fit.tau_s;
  const Eigen::VectorXd sd = (touches_.fit.covariance.diagonal().head(tau.size()) * widening()).cwiseSqrt();
  Estimate estimate = question_.delays == Delays::common
                          ? Estimate::scalar(quantity::kTau, tau[0], sd[0])
                          : Estimate::vector(delayKey(question_), {tau.begin(), tau.end()}, {sd.begin(), sd.end()});
  estimate.design = design_.tau_s_mm;
  estimate.per_shift = perShift(0, tau.size());
  return estimate;
}

std::optional<Estimate> TouchDelay::centre() const {
  const auto& fit = touches_.fit;
  if (fit.centre.size() != 3) return std::nullopt;
  const Eigen::VectorXd sd = fit.centre_sd * std::sqrt(widening());
  auto estimate = Estimate::vector(quantity::kCentre, {fit.centre.begin(), fit.centre.end()}, {sd.begin(), sd.end()});
  estimate.design = design_.centre;
  estimate.per_shift = perShift(question_.delayCount(), 3);
  return estimate;
}

// One gain stands for all deflections: by how much it changes on the way in, relative, is how well it is known.
double TouchDelay::bentBy() const {
  if (!touches_.whole || !touches_.fit.gain) return 0;
  double depth_mm = 0;
  for (const auto& retract : touches_.retracts)
    depth_mm = std::max(depth_mm, (*touches_.fit.gain * retract.probe_apex).norm());
  return touches_.whole->bend_per_mm * depth_mm;
}

std::optional<Estimate> TouchDelay::gainMatrix() const {
  const Eigen::Matrix3d back = turnedBack(spindle_rad_.value_or(0));
  const auto estimate = [&](const Eigen::Matrix3d& gain, std::vector<double> sd) {
    const Eigen::Matrix3d at_zero = back * gain;
    const auto entries = at_zero.reshaped<Eigen::RowMajor>();
    return Estimate::matrix(quantity::kGainMatrix, 3, {entries.begin(), entries.end()}, std::move(sd));
  };
  if (touches_.fit.gain) {
    const Eigen::Matrix3d at_zero = back * *touches_.fit.gain;
    const Eigen::Matrix3d sd_at_zero =
        (back.cwiseAbs2() * touches_.fit.gain_sd.cwiseAbs2() + (bentBy() * at_zero).cwiseAbs2()).cwiseSqrt();
    const auto sd = sd_at_zero.reshaped<Eigen::RowMajor>();
    return estimate(*touches_.fit.gain, {sd.begin(), sd.end()});
  }
  // Without a common gain the best that all touches have (A4); how uncertain it is nobody can tell.
  const auto count = static_cast<Eigen::Index>(touches_.retracts.size());
  Eigen::MatrixX3d velocities{count, 3};
  Eigen::MatrixX3d slopes{count, 3};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Retract& retract = touches_.retracts[static_cast<std::size_t>(i)];
    velocities.row(i) = retract.machine.slope.transpose();
    slopes.row(i) = retract.probe.slope.transpose();
  }
  const auto gain = metrology::gainMatrix(velocities, slopes);
  if (!gain) return std::nullopt;
  return estimate(gain.value(), {});
}

std::optional<Estimate> TouchDelay::lostMotion() const {
  const auto& whole = touches_.whole;
  if (!whole || whole->lost_mm.size() == 0) return std::nullopt;
  const Eigen::Index n = whole->lost_mm.size();
  const Eigen::VectorXd sd = (whole->covariance.diagonal().segment(whole->lostAt(), n) * widening()).cwiseSqrt();
  if (n == 1) return Estimate::scalar(quantity::kLostMotion, whole->lost_mm[0], sd[0]);
  return Estimate::vector(quantity::kLostMotion, {whole->lost_mm.begin(), whole->lost_mm.end()},
                          {sd.begin(), sd.end()});
}

std::optional<Estimate> TouchDelay::staticError(double stated_mm) const {
  if (question_.size_mm && !touches_.whole) return std::nullopt;
  const Estimate found = size();
  auto error = Estimate::scalar(quantity::kStaticError, found.value() - stated_mm, found.standardDeviation());
  error.design = found.design;
  error.per_shift = found.per_shift;
  return error;
}

// Nothing where the feature is as large as the case says. Where it does not say how well the size is known, it is taken
// as known within what temperature and a mistaken certificate change.
Outcome<std::optional<std::string>, Refusal> TouchDelay::whyNotAsStated(const Estimate& error) const {
  constexpr double kMost_sd = 4, kUnstated_mm = 0.01;
  double variance = 0;
  for (const auto* key :
       {"sd_effective_diameter_mm", "sd_gap_mm", "sd_diameter_mm", "sd_edge_mm", "sd_stylus_ball_diameter_mm"}) {
    TRY(const auto sd, configPositive(*dataset_, key));
    variance += sd.value_or(0) * sd.value_or(0);
  }
  const double stated = variance > 0 ? std::sqrt(variance) : kUnstated_mm;
  const double u = std::hypot(error.sd.empty() ? 0 : error.sd.front(), stated);
  if (std::abs(error.value()) <= kMost_sd * u) return std::optional<std::string>{};
  return std::optional{"static-error: by the touches the size is " + text(error.value() * 1e3) +
                       " um more than stated, which is " + text(std::abs(error.value()) / u) +
                       " times its standard uncertainty" + (variance > 0 ? "" : " (10 um, as none is stated)") +
                       ": look for a touch that slipped or met dirt, the temperature, the sizes in probe.toml and the "
                       "probe's threshold; a delay from the stated size alone would be wrong by as much"};
}

std::optional<Refusal> TouchDelay::addSizeCheck(Result& result) const {
  if (!question_.size_mm) return std::nullopt;
  if (const auto lost = lostMotion()) result.also.push_back(*lost);
  const auto error = staticError(*question_.size_mm);
  if (!error) return std::nullopt;
  TRY(const auto warning, whyNotAsStated(*error));
  if (warning) result.warnings.push_back(*warning);
  result.also.push_back(*error);
  return std::nullopt;
}

void TouchDelay::addWarnings(Result& result) const {
  for (auto& warning : droppedInWords(touches_.refusals, touches_.dropped, plans_))
    result.warnings.push_back(std::move(warning));
  for (const auto& warning : touches_.noise.warnings) result.warnings.push_back(warning);
  if (touches_.own_delays) result.warnings.push_back(*touches_.own_delays);
  if (!touches_.common_gain) {
    result.warnings.emplace_back(
        "the probe's gain differs between touches: each was extrapolated by its own slope; look for vibration, a tip "
        "that slips, and a gain that bends");
  }
  for (const auto& retract : touches_.retracts) {
    const double speed = retract.machine.slope.norm();
    if (std::abs(speed - retract.plan.speed_mm_s) <= 0.02 * retract.plan.speed_mm_s) continue;
    result.warnings.push_back(retract.plan.name + " ran at " + text(speed) + " mm/s, not " +
                              text(retract.plan.speed_mm_s) + ": check that the feed override is at 100 %");
  }
}

void TouchDelay::addResiduals(Result& result) const {
  result.design_per = touches_.whole ? kOneWay : kOneTouch;
  result.residuals = {.unit = "mm", .against = "normal_speed_mm_s", .names = {}, .at = {}, .values = {}};
  for (std::size_t i = 0; i < touches_.retracts.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.residuals.names.push_back(touches_.retracts[i].plan.name);
    result.residuals.at.push_back(touches_.fit.normal_speed[row]);
    result.residuals.values.push_back(touches_.fit.radial[row]);
  }
}

void TouchDelay::addTouched(Result& result) const {
  result.touched = Table::withColumns("touched", {column::kTime.name, column::kX.name, column::kY.name, column::kZ.name,
                                                  column::kNormalX.name, column::kNormalY.name, column::kNormalZ.name});
  for (const auto& retract : touches_.retracts) {
    const auto& at = retract.machine_apex;
    const auto& n = retract.plan.normal;
    result.touched.append({retract.machine.t_mean, at.x(), at.y(), at.z(), n.x(), n.y(), n.z()});
  }
}

Result TouchDelay::report() const {
  const TouchFit& fit = touches_.fit;
  Result result;
  result.method = dataset_->method;
  result.convention = kDelayConvention;
  result.rms = std::sqrt(fit.radial.squaredNorm() / static_cast<double>(fit.radial.size()));
  result.dof = touches_.noise.dof;
  result.condition = fit.condition;
  touches_.noiseCheck().report(result, kNoiseOfSamples);
  addWarnings(result);
  result.dropped = touches_.dropped;
  for (const auto& retract : touches_.retracts) {
    for (const auto& spike : retract.spikes) result.dropped.push_back({retract.plan.name + ", " + spike, "spike"});
  }
  addResiduals(result);
  addTouched(result);
  addResidualDelay(result, delay(), previous_);
  if (spindle_rad_) result.also.push_back(Estimate::scalar(std::string{kGainTakenAt}, *spindle_rad_, std::nullopt));
  return result;
}

Estimate TouchDelay::size() const {
  const auto variance = touches_.fit.covariance.diagonal().tail<1>()[0] * widening();
  auto estimate = Estimate::scalar(quantity::kEffectiveDiameter, touches_.fit.size_mm, std::sqrt(variance));
  estimate.design = design_.size;
  estimate.per_shift = perShift(touches_.fit.per_shift.rows() - 1, 1);
  return estimate;
}

Covariance TouchDelay::covarianceOf(std::span<const Estimate> estimates) const {
  const Eigen::MatrixXd& whole = touches_.fit.covariance;
  Covariance covariance;
  std::vector<Eigen::Index> rows;
  for (const auto& estimate : estimates) {
    const Eigen::Index first = estimate.key.starts_with("tau_")        ? 0
                               : estimate.key == quantity::kCentre.key ? question_.delayCount()
                                                                       : whole.rows() - 1;
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      const bool scalar = estimate.shape == Shape::scalar;
      covariance.components.push_back(scalar ? estimate.key : estimate.key + "[" + std::to_string(k) + "]");
      rows.push_back(first + static_cast<Eigen::Index>(k));
    }
  }
  const Eigen::MatrixXd chosen = whole(rows, rows) * widening();
  for (const double entry : chosen.reshaped<Eigen::RowMajor>()) covariance.values.push_back(entry);
  return covariance;
}

Outcome<Result, Refusal> TouchDelay::delayAlone() const {
  Result result = report();
  result.estimates.push_back(delay());
  result.covariance = covarianceOf(result.estimates);
  if (auto refusal = addSizeCheck(result)) return *refusal;
  return result;
}

Outcome<Result, Refusal> TouchDelay::onSphere() const {
  Result result = report();
  result.estimates.push_back(delay());
  if (const auto found = centre()) result.estimates.push_back(*found);
  result.covariance = covarianceOf(result.estimates);
  if (const auto gain = gainMatrix()) result.also.push_back(*gain);
  if (!question_.size_mm || touches_.whole) result.also.push_back(size());
  if (auto refusal = addSizeCheck(result)) return *refusal;
  return result;
}

}  // namespace probebox::metrology
