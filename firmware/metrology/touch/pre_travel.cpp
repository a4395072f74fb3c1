#include "firmware/metrology/touch/pre_travel.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/points.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kRadiusError{.key = "radius_error_mm", .kind = QuantityKind::error};

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kCentre = 3;        // parameters of the centre come first
constexpr double kBelow = -0.2;     // component along the stylus of a touch that tells pre-travel from height
constexpr double kAcross = 0.5;     // component across the stylus of a touch that tells the lobes
constexpr double kWidestGap = 0.9;  // rad; three lobes have a maximum or minimum every 1.05 rad
constexpr double kOneHeight = 0.1;  // touches whose components along the stylus differ by less are at one height

struct Sphere {
  std::vector<SwitchedTouch> touches;
  double radius_mm{};  // effective
  Index parts{};       // of the pre-travel: 4 with the one along the stylus
  bool size_free{};    // the heights tell an error of the size as well, which is the last parameter

  Index unknowns() const { return kCentre + parts + (size_free ? 1 : 0); }
};

// Distances from the centre less what radius and pre-travel say, over sigma.
Linearised modelAt(const Sphere& sphere, const VectorXd& parameters, double sigma_mm) {
  const auto rows = static_cast<Index>(sphere.touches.size());
  Linearised at{VectorXd{rows}, Eigen::MatrixXd{rows, sphere.unknowns()}};
  const VectorXd of_probe = parameters.segment(kCentre, sphere.parts);
  const double smaller_mm = sphere.size_free ? parameters[sphere.unknowns() - 1] : 0.0;
  for (Index row = 0; row < rows; ++row) {
    const Vector3d from_centre = sphere.touches[static_cast<std::size_t>(row)].at_mm - parameters.head<3>();
    const Vector3d n = from_centre.normalized();
    const RowVectorXd parts = preTravelParts(n).head(sphere.parts);
    at.residuals[row] = (from_centre.norm() - sphere.radius_mm + smaller_mm + parts.dot(of_probe)) / sigma_mm;
    at.jacobian.row(row).head(kCentre + sphere.parts) << -n.transpose() / sigma_mm, parts / sigma_mm;
    if (sphere.size_free) at.jacobian(row, sphere.unknowns() - 1) = 1 / sigma_mm;
  }
  return at;
}

std::optional<Refusal> whyFewDirections(const std::vector<SwitchedTouch>& touches) {
  std::vector<double> around_rad;
  for (const auto& touch : touches) {
    if (touch.normal.head<2>().norm() > kAcross) around_rad.push_back(std::atan2(touch.normal.y(), touch.normal.x()));
  }
  std::ranges::sort(around_rad);
  double widest = around_rad.empty() ? kTurn : around_rad.front() + kTurn - around_rad.back();
  for (std::size_t i = 1; i < around_rad.size(); ++i) widest = std::max(widest, around_rad[i] - around_rad[i - 1]);
  if (widest <= kWidestGap) return std::nullopt;
  return Refusal{"few-directions", "no touch across the stylus for " + text(degrees(widest)) +
                                       " degrees around it: touch the sphere at least every 50 degrees, best every 30"};
}

std::size_t heightsOf(const std::vector<SwitchedTouch>& touches) {
  std::vector<double> along;
  for (const auto& touch : touches) along.push_back(touch.normal.z());
  std::ranges::sort(along);
  std::size_t heights = 0;
  double last = -2;
  for (const double z : along) {
    if (z - last <= kOneHeight) continue;
    ++heights;
    last = z;
  }
  return heights;
}

Outcome<Sphere, Refusal> readSphere(const Dataset& dataset) {
  TRY(const auto diameter, requiredPositive(dataset, "effective_diameter_mm"));
  TRY(const auto tau, configVector(dataset, "previous_tau_axis_s"));
  TRY(auto touches, switchedTouches(dataset, tau.value_or(std::array<double, 3>{})));
  if (auto refusal = whyFewDirections(touches)) return *refusal;
  const bool from_below =
      std::ranges::any_of(touches, [](const SwitchedTouch& touch) { return touch.normal.z() < kBelow; });
  // Part across, height of the centre and size need a height each, and so does the part along the stylus.
  const bool size_free = heightsOf(touches) >= (from_below ? 4U : 3U);
  return Sphere{std::move(touches), diameter / 2, from_below ? 4 : 3, size_free};
}

// Mean lateness of the switch with its standard deviation.
Estimate lateness(const std::vector<SwitchedTouch>& touches) {
  const auto n = static_cast<double>(touches.size());
  double mean = 0, squares = 0;
  for (const auto& touch : touches) mean += touch.late_s / n;
  for (const auto& touch : touches) squares += (touch.late_s - mean) * (touch.late_s - mean);
  return Estimate::scalar("switch_late_s", mean, std::sqrt(squares / (n - 1) / n));
}

// The switch trips no earlier than it touches, whichever part says so.
std::optional<Refusal> whyNegative(const Sphere& sphere, const Fit& fit, const Answer& answer) {
  for (const Index part : {Index{0}, Index{3}}) {
    if (part >= sphere.parts) continue;
    RowVectorXd whole = RowVectorXd::Zero(sphere.unknowns());
    whole[kCentre + part] = 1;
    if (sphere.size_free) whole[sphere.unknowns() - 1] = 1;
    const double way_mm = whole.dot(fit.parameters);
    const auto sd_mm = answer.sdOf(whole);
    if (!sd_mm || way_mm >= -3 * *sd_mm) continue;
    return Refusal{"pre-travel-negative",
                   "the probe triggers " + text(-way_mm) + " mm before it touches, " +
                       (part == 0 ? "across" : "along") +
                       " the stylus, which is impossible: check the diameters of the sphere and of the stylus ball "
                       "(effective_diameter_mm), and that the shank passes the sphere"};
  }
  return std::nullopt;
}

}  // namespace

Eigen::RowVector4d preTravelParts(const Vector3d& n) {
  const double across = std::hypot(n.x(), n.y());
  const double around_rad = std::atan2(n.y(), n.x());
  return {across, across * std::cos(3 * around_rad), across * std::sin(3 * around_rad), std::abs(n.z())};
}

Outcome<Result, Refusal> solvePreTravel(const Dataset& dataset) {
  if (auto refusal = refuseTurnedProbe(dataset)) return *refusal;
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto sphere, readSphere(dataset));
  const auto& touches = sphere.touches;
  Rows3 points{static_cast<Index>(touches.size()), 3};
  for (std::size_t i = 0; i < touches.size(); ++i) points.row(static_cast<Index>(i)) = touches[i].at_mm.transpose();
  if (auto refusal = equalPoints(points)) return *refusal;
  const auto about = algebraicBall(points);
  if (!about) return Refusal{"coplanar", "the touches lie in one plane: touch the top of the sphere as well"};
  VectorXd start = VectorXd::Zero(sphere.unknowns());
  start.head<3>() = about->centre;
  const auto fit =
      leastSquares([&](const VectorXd& parameters) { return modelAt(sphere, parameters, sigma.value); }, start);
  if (!fit) return fit.error();
  Answer answer{dataset, *fit, sigma};
  answer.readings(*dataset.table("touches"), {column::kDistance}, column::kTouch, 1);
  answer.readingIs("one distance from the centre, mm", "mm");
  const Index size = sphere.unknowns();
  answer.promiseVector(quantity::kPreTravel, fit->parameters.segment(kCentre, sphere.parts),
                       pick(kCentre, sphere.parts, size));
  answer.promiseVector(quantity::kCentre, fit->parameters.head<3>(), pick(0, kCentre, size));
  if (auto refusal = whyNegative(sphere, *fit, answer)) return *refusal;
  if (sphere.size_free) {
    answer.alsoScalar(kRadiusError, -fit->parameters[size - 1], pick(size - 1, 1, size).row(0));
  } else {
    answer.result().unobservable.emplace_back(
        "an error of effective_diameter_mm, and a part of the pre-travel that is the same in all directions: touch at "
        "one more height to tell them from the parts across and along the stylus");
  }
  if (sphere.parts < 4)
    answer.result().unobservable.emplace_back(
        "pre-travel along the stylus: it is in the height of "
        "the centre, unless the sphere is touched from below as well");
  Result result = std::move(answer).take(true);
  result.also.push_back(lateness(touches));
  return result;
}

namespace {

constexpr MethodTable kTables[]{
    {"machine", kMachineColumns, "position of the moving reference at its stamp"},
    {"touches", kTouchesColumns, "a touch: outward normal n, direction u of the retract, speed in and out"},
    {"edges", kEdgesColumns, "when the switch opened on the way in, and closed on the way out"}};
constexpr MethodKey kKeys[]{
    {"effective_diameter_mm", kNeeded, "of sphere plus stylus ball"},
    MethodKey{"previous_tau_axis_s", "[0,0,0]", "delays in force, taken out of the positions"}.upTo(
        quantity::kMostDelay_s),
    key::kSigma,
    kProbeAtZero,
    kProbeB};
constexpr KnownQuantity kKnown[]{{"sd_effective_diameter_mm", "effective_diameter_mm"},
                                 {"sd_stylus_ball_diameter_mm", "effective_diameter_mm", KnownKind::value}};
constexpr Quantity kResults[]{quantity::kPreTravel, quantity::kCentre};
constexpr Quantity kFurther[]{kRadiusError};
constexpr std::string_view kUnobservable[]{
    "a pre-travel that differs between opposite sides once around: it displaces the stylus ball, and every centre "
    "alike",
    "a pre-travel from below that differs from the one from above: it goes into the part along the stylus by 1.5 "
    "times"};

std::optional<Subject> preTravelSubject(const Dataset& dataset) {
  return numberedSubject(dataset, SubjectKind::pre_travel, "probe_tool").value_or(Subject{SubjectKind::pre_travel});
}

}  // namespace

const Method kPreTravel{.name = "pre-travel",
                        .title = "Pre-travel of a touch-trigger probe by direction",
                        .equations = "(A23)",
                        .source = source::kMachine,
                        .solver = solvePreTravel,
                        .tables = kTables,
                        .keys = kKeys,
                        .known = kKnown,
                        .results = kResults,
                        .further = kFurther,
                        .unobservable = kUnobservable,
                        .subject = {.about = Subject{SubjectKind::pre_travel}, .of = preTravelSubject}};

}  // namespace probebox::metrology
