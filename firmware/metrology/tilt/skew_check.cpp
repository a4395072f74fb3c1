#include "firmware/metrology/tilt/skew_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace probebox::metrology {
namespace {

constexpr double kGross_mm = 0.1;
constexpr double kDeviations = 5.0;
constexpr double kMostLean_rad = 0.1;     // as any direction against its machine axis
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
  if (lean_rad > kMostLean_rad)
    return Refusal{"implausible", leans + ", more than 0.1: check the tilt of each row, and measure at a third tilt"};
  const double noise = std::sqrt(fit.cofactor.diagonal().tail<2>().sum()) * (sigma.stated ? 1.0 : kUsualNoise_mm);
  if (lean_rad <= kUsualLean_rad + kDeviations * noise) return std::optional<std::string>{};
  return std::optional{leans + ", more than 0.002: one of the tilts may be wrong; check them, or read at a third tilt"};
}

}  // namespace

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
          "readings-contradict",
          "the reading at a tilt of " + text(reading.tilt_deg) + " degrees is " + text(change.mm) +
              " mm from where the other readings put it along the axis, skew included: one of the readings is wrong; "
              "measure again, with a third tilt"};
    }
    if (beyond && !warning)
      warning = "the readings along the axis contradict its skew by " + text(change.mm) +
                " mm: one of them may be wrong; read at a third tilt to find it";
  }
  TRY(const auto lean, checkLean(fit, sigma));
  return warning ? warning : lean;
}

}  // namespace probebox::metrology
