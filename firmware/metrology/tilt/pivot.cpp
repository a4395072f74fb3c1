#include "firmware/metrology/tilt/pivot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/tilt/tilt_readings.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kGross_mm = 0.1;
constexpr double kDeviations = 5.0;

constexpr double kUsualLean_rad = 0.002;  // chosen: several times what a poor machine has
constexpr double kUsualNoise_mm = 0.01;   // chosen, where no sigma is stated

// How far a reading is off what the first one of its point says, along the axis.
struct Change {
  double mm{};
  double sd_mm{};
};

Change changeOf(const TiltReading& reading, const TiltReading& first, const Fit& fit, const Sigma& sigma) {
  const Eigen::Vector2d moved = reading.at - first.at;
  const Eigen::Vector2d skew = fit.parameters.tail<2>();
  const double mm = reading.along - first.along + skew.dot(moved);
  if (!sigma.stated) return {mm, std::numeric_limits<double>::infinity()};
  const Eigen::Matrix2d covariance = fit.cofactor.bottomRightCorner<2, 2>();
  return {mm, std::sqrt(2.0 * sigma.value * sigma.value * (1.0 + skew.squaredNorm()) + moved.dot(covariance * moved))};
}

// Two tilts fit any lean exactly: one tilt that is wrong by degrees is a lean that no axis has.
Outcome<std::optional<std::string>, Refusal> checkLean(const Fit& fit, const Sigma& sigma) {
  const double lean_rad = fit.parameters.tail<2>().norm();
  const std::string leans = "the readings say that the axis leans by " + text(lean_rad) + " rad off its machine axis";
  if (lean_rad > quantity::kMostLean_rad)
    return Refusal{"implausible", leans + ", more than 0.1: check the tilt of each row, and measure at a third tilt"};
  const double noise = std::sqrt(fit.cofactor.diagonal().tail<2>().sum()) * (sigma.stated ? 1.0 : kUsualNoise_mm);
  if (lean_rad <= kUsualLean_rad + kDeviations * noise) return std::optional<std::string>{};
  return std::optional{leans + ", more than 0.002: one of the tilts may be wrong; check them, or read at a third tilt"};
}

// Checks the skew of a fit in the plane, its last two parameters, against the coordinates along the axis, which that
// fit does not use. For a point that turns about the axis u = (skew, 1), u . p is the same at every tilt; a bad one of
// two readings at different places along the axis looks like a skew, but changes u . p. A change beyond 5 sd gives a
// warning; if it also exceeds 0.1 mm (without sigma_mm: that alone), it refuses: readings-contradict.
// A lean beyond 2 mrad (and its noise) gives a warning, one beyond 0.1 rad is refused: implausible.
Outcome<std::optional<std::string>, Refusal> checkSkew(const std::vector<TiltReading>& readings, const Fit& fit,
                                                       const Sigma& sigma) {
  std::map<std::size_t, const TiltReading*> first;
  std::optional<std::string> warning;
  for (const auto& reading : readings) {
    const auto [seen, is_new] = first.emplace(reading.point, &reading);
    if (is_new) continue;
    const auto change = changeOf(reading, *seen->second, fit, sigma);
    const bool beyond = std::abs(change.mm) > kDeviations * change.sd_mm;
    if (std::abs(change.mm) > kGross_mm && (beyond || !sigma.stated)) {
      return Refusal{
          std::string{kReadingsContradict},
          "the reading at a tilt of " + text(reading.tilt_deg) + " degrees is " + text(change.mm) +
              " mm from where the other readings put it along the axis, skew included: one of the readings is wrong; "
              "measure again, with a third tilt"};
    }
    if (beyond && !warning)
      warning = std::string{kReadingsContradict} + ": the readings along the axis contradict its skew by " +
                text(change.mm) + " mm: one of them may be wrong; read at a third tilt to find it";
  }
  TRY(const auto lean, checkLean(fit, sigma));
  return warning ? warning : lean;
}

using Eigen::Vector2d;

constexpr double kSkewLength = 1.0;  // mm

// Whether points lie far enough apart along the axis to show that it is not quite parallel to its machine axis.
bool skewSeen(const std::vector<TiltReading>& readings) {
  const auto [least, greatest] = std::ranges::minmax(readings, {}, &TiltReading::along);
  return greatest.along - least.along > kSkewLength && std::ranges::max(readings, {}, &TiltReading::point).point > 0;
}

std::optional<Refusal> shortArm(const std::vector<TiltReading>& readings, const Fit& fit, const Sigma& sigma) {
  double longest = 0.0;
  for (const auto& reading : readings) {
    longest = std::max(longest, fit.parameters.segment<2>(static_cast<Eigen::Index>(2 + 2 * reading.point)).norm());
  }
  return refuseArm(longest, sigma);
}

// Means over the other axis at tilts of -90 and 0; nothing where the data are not just these, each point at both. A
// reading beside these tilts is turned about the pivot from the tilt it reports to the nominal one.
std::optional<std::pair<Vector2d, Vector2d>> quarterTurn(const std::vector<TiltReading>& readings,
                                                         const Vector2d& pivot) {
  std::array<Vector2d, 2> sums{Vector2d::Zero(), Vector2d::Zero()};
  std::array<std::vector<std::size_t>, 2> points;
  for (const auto& reading : readings) {
    const bool flat = std::abs(reading.tilt_deg) <= kPoseTolerance_deg;
    const double beside_deg = flat ? reading.tilt_deg : reading.tilt_deg + 90.0;
    if (std::abs(beside_deg) > kPoseTolerance_deg) return std::nullopt;
    sums[flat ? 1 : 0] += pivot + turn(-beside_deg * kDegree) * (reading.at - pivot);
    points[flat ? 1 : 0].push_back(reading.point);
  }
  for (auto& list : points) std::ranges::sort(list);
  if (points[0] != points[1]) return std::nullopt;
  const auto n = static_cast<double>(points[0].size());
  return std::pair<Vector2d, Vector2d>{sums[0] / n, sums[1] / n};
}

// The pivot where the mean of the readings is along the axis: it moves along a skew one.
Vector2d amongReadings(const std::vector<TiltReading>& readings, const Fit& fit) {
  const Vector2d pivot = fit.parameters.head<2>();
  if (!skewSeen(readings)) return pivot;
  double along = 0.0;
  for (const auto& reading : readings) along += reading.along / static_cast<double>(readings.size());
  return pivot + along * fit.parameters.tail<2>();
}

// (B28): with r = (|y1 - y2| + |z1 - z2|)/2 the pivot is (y1 -+ r, z2 -+ r), signs as (B29) has them.
std::optional<Refusal> failsCheck(const std::vector<TiltReading>& readings, const Vector2d& pivot) {
  const auto means = quarterTurn(readings, pivot);
  if (!means) return std::nullopt;
  const auto& [tilted, flat] = *means;
  const double r = (tilted - flat).cwiseAbs().sum() / 2.0;
  const Vector2d checked{tilted.x() - std::copysign(r, tilted.x() - pivot.x()),
                         flat.y() - std::copysign(r, flat.y() - pivot.y())};
  if ((checked - pivot).norm() <= 1e-6 * (1.0 + r)) return std::nullopt;
  return Refusal{"pivot-check-disagrees", "the half sums of the readings at -90 and 0 locate the pivot " +
                                              text((checked - pivot).norm()) +
                                              " mm away: the C axis is further from the pivot than the ball's height; "
                                              "measure at a third tilt, or with the ball further out"};
}

Outcome<std::optional<std::string>, Refusal> checkedSkew(const std::vector<TiltReading>& readings, const Fit& fit,
                                                         const Sigma& sigma) {
  if (!skewSeen(readings)) return std::optional<std::string>{};
  return checkSkew(readings, fit, sigma);
}

Result answered(const Dataset& dataset, const SwivelPlane& plane, const TiltReadings& tilts, const Fit& fit,
                const TiltNoise& noise) {
  constexpr std::array<std::string_view, 2> kParts{"first of the plane", "second of the plane"};
  Answer answer{dataset, fit, noise.position};
  for (const auto& warning : noise.warnings) answer.warn(warning);
  const Table& table = *dataset.table("readings");
  answer.readings(table, kParts, table.column(column::kB) ? column::kB : kTilt);
  Vector2d pivot = fit.parameters.head<2>();
  Eigen::MatrixXd rows = pick(0, 2, fit.parameters.size());
  if (!plane.alphabetical()) {
    pivot = pivot.reverse().eval();
    rows = rows.colwise().reverse().eval();
  }
  answer.promiseVector("pivot_" + plane.name() + "_mm", pivot, rows);
  answer.result().also.push_back(Estimate::scalar(quantity::kAlong, tilts.centre_along, std::nullopt));
  if (const auto warning = anglesApart(tilts)) answer.warn(*warning);
  return std::move(answer).take(true);
}

}  // namespace

Outcome<Result, Refusal> solveTablePivot(const Dataset& dataset) {
  TRY(const auto noise, tiltNoise(dataset));
  TRY(const auto plane, swivelPlane(dataset, "tilt_axis"));
  TRY(const auto table, checkedTable(dataset, "readings", kTableTiltColumns));
  const auto tilts = tiltReadings(*table, plane, nullptr);
  const auto& readings = tilts.readings;
  TRY(const auto fit, fitTilts(readings, skewSeen(readings), noise));
  if (auto refusal = shortArm(readings, fit, noise.position)) return *refusal;
  TRY(const auto skew, checkedSkew(readings, fit, noise.position));
  // The source's equations know no weights.
  TRY(const auto plain, fitTilts(readings, skewSeen(readings), {noise.position, 0.0, {}}));
  if (auto refusal = failsCheck(readings, amongReadings(readings, plain))) return *refusal;
  Result result = answered(dataset, plane, tilts, fit, noise);
  if (skew) result.warnings.push_back(*skew);
  result.convention =
      "machine coordinates of the tilt axis, where it passes along_mm, as the tip of the stylus has them with the "
      "spindle at A = 0";
  return result;
}

Outcome<Result, Refusal> solveHeadPivot(const Dataset& dataset) {
  TRY(const auto noise, tiltNoise(dataset));
  TRY(const auto plane, swivelPlane(dataset, "swivel_axis"));
  TRY(const auto ball, tiltedBall(dataset));
  TRY(const auto table, checkedTable(dataset, "readings", kHeadTiltColumns));
  const auto tilts = tiltReadings(*table, plane, &ball);
  TRY(const auto fit, fitTilts(tilts.readings, skewSeen(tilts.readings), noise));
  if (auto refusal = shortArm(tilts.readings, fit, noise.position)) return *refusal;
  TRY(const auto skew, checkedSkew(tilts.readings, fit, noise.position));
  Result result = answered(dataset, plane, tilts, fit, noise);
  if (skew) result.warnings.push_back(*skew);
  result.convention =
      "swivel axis from the moving reference, ball minus centre of the readings: with the length of the tool that read";
  return result;
}

namespace {

constexpr Quantity kPivotTableResults[]{
    quantity::kPivotYz.as("the tilt axis across X; pivot_xz_mm of a tilt about Y, pivot_xy_mm about Z")};
constexpr Quantity kPivotHeadResults[]{
    quantity::kPivotXz.as("a swivel about Y, from the moving reference; pivot_yz_mm about X, pivot_xy_mm about Z")};

}  // namespace

const Method kTablePivot{.name = "table-pivot",
                         .title = "Pivot of a tilting table",
                         .equations = "(B28), (B29)",
                         .source = source::kMachine,
                         .solver = solveTablePivot,
                         .tables = kTableTiltTables,
                         .keys = kTableTiltKeys,
                         .results = kPivotTableResults,
                         .further = quantity::kPivots,
                         .unobservable = kTableTiltUnobservable};

const Method kHeadPivot{.name = "head-pivot",
                        .title = "Pivot of a swivelling head",
                        .equations = "(B29), (B30)",
                        .source = source::kMachine,
                        .solver = solveHeadPivot,
                        .tables = kHeadTiltTables,
                        .keys = kHeadTiltKeys,
                        .known = kBallKnown,
                        .results = kPivotHeadResults,
                        .further = quantity::kPivots,
                        .unobservable = kHeadTiltUnobservable};

}  // namespace probebox::metrology
