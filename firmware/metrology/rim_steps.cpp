#include "firmware/metrology/rim_steps.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/ball_readings.hpp"
#include "firmware/metrology/centreline.hpp"
#include "firmware/metrology/limited_access.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;

constexpr std::array<std::string_view, 4> kColumns{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 3> kStylusColumns{"A_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 2> kContactColumns{"C1_rad", "C2_rad"};
constexpr std::array<std::string_view, 4> kKeys{"sigma_mm", "sigma_C_rad", "level_limit_mm", "trust_C_angles"};
constexpr double kLevelLimit = 0.01;  // mm
constexpr double kLeastTheta = 15.0 * std::numbers::pi / 180.0;
constexpr double kSameAngle = 1e-6;  // rad
constexpr int kMostLoops = 5;
constexpr double kDisagree = 4.0;  // sd

struct RimReading {
  double c{};  // rad, clockwise, from the zero in force
  Vector2d at;
};
using Loop = std::vector<RimReading>;

// Step 1: readings with the spindle half a turn apart; the later ones are made with the spindle at zero.
Outcome<Vector2d, Refusal> stylusOffset(const Dataset& dataset) {
  if (!dataset.table("stylus")) return Vector2d{0.0, 0.0};
  const auto table = checkedTable(dataset, "stylus", kStylusColumns);
  if (!table) return table.error();
  std::array<Vector2d, 2> sums{Vector2d::Zero(), Vector2d::Zero()};
  std::array<double, 2> counts{};
  for (std::size_t row = 0; row < (*table)->rows(); ++row) {
    const double angle = std::remainder((*(*table)->column("A_rad"))[row], 2.0 * std::numbers::pi);
    const bool zero = std::abs(angle) < kSameAngle;
    if (!zero && std::abs(std::abs(angle) - std::numbers::pi) > kSameAngle) counts = {};
    sums[zero ? 0 : 1] += Vector2d{(*(*table)->column("x_mm"))[row], (*(*table)->column("y_mm"))[row]};
    counts[zero ? 0 : 1] += 1.0;
  }
  if (counts[0] == 0.0 || counts[1] == 0.0) {
    return Refusal{"not-opposite", "table 'stylus' needs readings with the spindle at 0 and at 180 degrees"};
  }
  return Vector2d{(sums[1] / counts[1] - sums[0] / counts[0]) / 2.0};
}

Outcome<std::vector<Loop>, Refusal> loopsOf(const Table& table, const Vector2d& stylus) {
  std::vector<Loop> loops;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*table.column(kColumns[k]))[row]; };
    const double loop = value(0);
    if (loop != std::floor(loop) || loop < 1.0 || loop > static_cast<double>(loops.size() + 1)) {
      return Refusal{"bad-loop", "table 'readings', row " + std::to_string(row + 1) +
                                     ": loops are counted 1, 2, .. in the order in which they were measured"};
    }
    if (loop > kMostLoops) {
      return Refusal{"too-many-loops",
                     "the zero of C does not settle within 5 loops: is the ball loose, or the drive?"};
    }
    loops.resize(std::max(loops.size(), static_cast<std::size_t>(loop)));
    loops[static_cast<std::size_t>(loop) - 1].push_back({value(1), Vector2d{value(2), value(3)} + stylus});
  }
  return loops;
}

const RimReading* readingAt(const Loop& loop, double angle) {
  const auto found = std::ranges::find_if(loop, [&](const auto& r) { return std::abs(r.c - angle) < kSameAngle; });
  return found == loop.end() ? nullptr : &*found;
}

// The readings of one loop; zero is at the origin where it was not read.
Outcome<RimSteps, Refusal> stepsOf(const Loop& loop, std::size_t number, bool last) {
  const auto plus = std::ranges::max_element(loop, {}, &RimReading::c);
  const RimReading* minus = readingAt(loop, -plus->c);
  const RimReading* zero = readingAt(loop, 0.0);
  if (!minus || (last && !zero)) {
    return Refusal{"missing-step", "loop " + std::to_string(number) + " needs readings at +theta and -theta" +
                                       (last ? ", and at C = 0" : "")};
  }
  if (plus->c < kLeastTheta) {
    return Refusal{"arc-too-short", "theta of loop " + std::to_string(number) + " is " +
                                        text(plus->c * 180.0 / std::numbers::pi) +
                                        " degrees, less than 15: turn 30 to 45 to either side"};
  }
  return RimSteps{plus->at, minus->at, zero ? zero->at : Vector2d{0.0, 0.0}, plus->c};
}

// Steps 3 to 5 gone through: where the zero of C went, loop by loop, and the readings of the last loop.
struct Settled {
  std::vector<double> zeros;  // of each loop, in the count of the first; rad
  RimSteps steps;
};

Outcome<Settled, Refusal> settle(const std::vector<Loop>& loops, double level_limit) {
  Settled settled;
  double zero = 0.0;
  for (std::size_t k = 0; k < loops.size(); ++k) {
    const bool last = k + 1 == loops.size();
    const auto steps = stepsOf(loops[k], k + 1, last);
    if (!steps) return steps.error();
    settled.zeros.push_back(zero);
    settled.steps = steps.value();
    const double unlevel = std::abs(steps->plus.y() - steps->minus.y());
    if (last && unlevel >= level_limit) {
      return Refusal{"not-level", "the last loop's readings at +theta and -theta differ by " + text(unlevel) +
                                      " mm in y, not less than level_limit_mm: shift the zero of C and read once more"};
    }
    if (unlevel >= level_limit) zero += remainingShift(steps->plus, steps->minus);
  }
  return settled;
}

// What the centre of the steps is uncertain by: differences of (B26), (B27) in each coordinate of each reading, which
// the noise of C moves along the rim.
struct StepsSd {
  Vector2d centre;
  double radius{};
};

StepsSd sdOf(const RimSteps& steps, const RimCentre& centre, const RotationNoise& noise) {
  constexpr double kStep = 1e-3;  // mm
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Vector2d RimSteps::*reading : {&RimSteps::plus, &RimSteps::minus, &RimSteps::zero}) {
    Eigen::Matrix<double, 3, 2> slopes;
    for (Eigen::Index k = 0; k < 2; ++k) {
      RimSteps up = steps;
      RimSteps down = steps;
      (up.*reading)[k] += kStep;
      (down.*reading)[k] -= kStep;
      const auto above = turnedRimCentre(up);
      const auto below = turnedRimCentre(down);
      if (!above || !below) continue;
      slopes.col(k) << (above->centre - below->centre) / (2.0 * kStep), (above->radius - below->radius) / (2.0 * kStep);
    }
    const Vector2d arm = steps.*reading - centre.centre;
    const Vector2d along{-arm.y(), arm.x()};
    const Eigen::Matrix2d of_reading = noise.position * noise.position * Eigen::Matrix2d::Identity() +
                                       noise.angle * noise.angle * along * along.transpose();
    covariance += slopes * of_reading * slopes.transpose();
  }
  return {covariance.diagonal().head<2>().cwiseSqrt(), std::sqrt(covariance(2, 2))};
}

// The radius from the reading at +theta and from that at -theta, and the steps against the fit.
std::optional<std::string> disagreement(const RimSteps& steps, const RimCentre& found, const Vector2d& fitted,
                                        const StepsSd& sd) {
  RimSteps other = steps;
  std::swap(other.plus, other.minus);
  const auto mirrored = turnedRimCentre(other);
  if (mirrored && std::abs(mirrored->radius - found.radius) > kDisagree * 2.0 * sd.radius) {
    return "the readings at +theta and -theta give radii that differ by " +
           text(std::abs(mirrored->radius - found.radius)) + " mm";
  }
  const Vector2d off = found.centre - fitted;
  for (Eigen::Index k = 0; k < 2; ++k) {
    if (std::abs(off[k]) > kDisagree * sd.centre[k]) {
      return "the steps put the centre " + text(std::abs(off[k])) + " mm from the fit of all readings in " +
             std::string(1, "xy"[k]) + ", more than 4 sd";
    }
  }
  return std::nullopt;
}

Outcome<double, Refusal> contactShift(const Dataset& dataset) {
  if (!dataset.table("contacts")) return 0.0;
  const auto table = checkedTable(dataset, "contacts", kContactColumns);
  if (!table) return table.error();
  Dataset alone{.method = "c-zero-shift", .config = {}, .tables = {**table}};
  const auto solved = solveCZeroShift(alone);
  if (!solved) return solved.error();
  return solved->find("C_shift_rad")->value();
}

}  // namespace

Outcome<Result, Refusal> solveCentrelineBySteps(const Dataset& dataset) {
  const auto noise = statedNoise(dataset);
  if (!noise) return noise.error();
  const auto level_limit = configPositive(dataset, "level_limit_mm");
  if (!level_limit) return level_limit.error();
  const auto trusted = configSwitch(dataset, "trust_C_angles");
  if (!trusted) return trusted.error();
  const bool trust = trusted.value() || !dataset.config.contains("trust_C_angles");
  const auto table = checkedTable(dataset, "readings", kColumns);
  if (!table) return table.error();
  const auto stylus = stylusOffset(dataset);
  if (!stylus) return stylus.error();
  const auto contact = contactShift(dataset);
  if (!contact) return contact.error();
  const auto loops = loopsOf(**table, stylus.value());
  if (!loops) return loops.error();
  const auto settled = settle(loops.value(), level_limit->value_or(kLevelLimit));
  if (!settled) return settled.error();
  const RimSteps& steps = settled->steps;
  const auto plain = rimCentre(steps.plus, steps.minus, steps.zero);
  const auto found = turnedRimCentre(steps);
  if (!plain || !found) {
    return Refusal{"level-readings",
                   "the readings at 0 and at theta are equally high: they tell no radius; turn further"};
  }
  std::vector<RotationReading> readings;
  for (std::size_t k = 0; k < loops->size(); ++k) {
    for (const auto& reading : (*loops)[k]) readings.push_back({reading.at, -(reading.c + settled->zeros[k])});
  }
  const auto fit = fitRotation(readings, noise->noise);
  if (!fit) return fit.error();
  const Vector2d centre = fit->parameters.head<2>();
  const Vector2d arm = fit->parameters.tail<2>();
  const StepsSd sd = sdOf(steps, *found, noise->noise);
  const auto differ = noise->stated ? disagreement(steps, *found, centre, sd) : std::nullopt;
  if (differ && trust) {
    return Refusal{"steps-disagree",
                   *differ + ": are the angles of C right? Set trust_C_angles to false if they are not"};
  }

  Answer answer{dataset, fit.value(), {noise->noise.position, noise->stated}};
  answer.promiseVector("centre_mm", centre, pick(0, 2, 4));
  answer.promiseScalar("radius_mm", arm.norm(), Eigen::RowVector4d{0.0, 0.0, arm.x(), arm.y()} / arm.norm());
  if (differ) answer.warn(*differ + "; the angles of C are not trusted, so the steps count");
  for (auto& warning : unusedKeys(dataset, kKeys)) answer.warn(std::move(warning));
  answer.result().convention = "C clockwise from +Y";
  Result result = std::move(answer).take(false);
  auto& also = result.also;
  also.push_back(Estimate::vector("fit_centre_mm", {centre.x(), centre.y()}, {}));
  also.push_back(Estimate::vector("steps_centre_mm", {plain->centre.x(), plain->centre.y()}, {}));
  also.push_back(Estimate::scalar("steps_radius_mm", plain->radius, std::nullopt));
  also.push_back(Estimate::scalar("C_shift_rad", contact.value() + settled->zeros.back(), std::nullopt));
  also.push_back(Estimate::vector("stylus_offset_mm", {stylus->x(), stylus->y()}, {}));
  if (!trust) {
    const std::vector<double> sds = noise->stated ? std::vector{sd.centre.x(), sd.centre.y()} : std::vector<double>{};
    result.estimates = {
        Estimate::vector("centre_mm", {found->centre.x(), found->centre.y()}, sds),
        Estimate::scalar("radius_mm", found->radius, noise->stated ? std::optional{sd.radius} : std::nullopt)};
  }
  return result;
}

}  // namespace probebox::metrology
