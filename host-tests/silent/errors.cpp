#include "host-tests/silent/errors.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/checks/likely_causes.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/uncertainty/machine_errors.hpp"
#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology::silent {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

// A segment of the screw that is 5 K warmer than the rest.
constexpr double kWarmSegment_mm = 100, kWarmStrain = 5 * 11.5e-6;

// What is off where the machine believes to be, by the errors of its axes.
struct OffAxes {
  Vector3d scale = Vector3d::Zero(), warm_from = Vector3d::Constant(HUGE_VAL);
  double xy{}, xz{}, yz{};

  OffAxes(const Errors& errors, Random& random) : warmth_{errors.size} {
    const auto either = [&](double size) {
      return uniform(random, 0, 1) < 0.5 ? -errors.size * size : errors.size * size;
    };
    if (errors.has(Err::scale)) scale = Vector3d{either(kScale), either(kScale), either(kScale)};
    if (errors.has(Err::squareness))
      xy = either(kSquareness_rad), xz = either(kSquareness_rad), yz = either(kSquareness_rad);
    if (errors.has(Err::uneven_screw))
      for (double& from : warm_from) from = uniform(random, -60, 20);
  }
  Vector3d operator()(const Vector3d& at) const {
    Vector3d off = scale.cwiseProduct(at) + Vector3d{xy * at.y() + xz * at.z(), yz * at.z(), 0};
    const auto warmth = [&](double place, Index k) {
      return std::isinf(warm_from[k]) ? 0
                                      : warmth_ * kWarmStrain * std::clamp(place - warm_from[k], 0.0, kWarmSegment_mm);
    };
    for (Index k = 0; k < 3; ++k) off[k] += warmth(at[k], k) - warmth(0, k);
    return off;
  }

 private:
  double warmth_;
};

Vector3d atContact(const Errors& errors, const Vector3d* side) {
  const Vector3d from_above{0, 0, 1};
  const Vector3d& n = side != nullptr ? *side : from_above;
  double outwards = 0;
  if (errors.has(Err::lost_motion)) outwards += kLost_mm / 2;
  if (errors.has(Err::hysteresis)) outwards += kHysteresis_mm / 2;
  if (errors.has(Err::lobing) && side != nullptr) outwards += lobe_mm(n);
  return errors.size * outwards * n;
}

// Twice a turn.
struct RunOut {
  double size_mm{}, phase{};

  RunOut(const Errors& errors, Random& random) {
    if (errors.has(Err::run_out)) size_mm = errors.size * kRunOut_mm, phase = uniform(random, 0, kTurn);
  }
  Vector3d at(const Column* c, std::size_t row) const {
    if (c == nullptr || size_mm == 0) return Vector3d::Zero();
    const double twice = 2 * c->values[row] * (isInDegrees(c->name) ? kDegree : 1) + phase;
    return {size_mm * std::cos(twice), size_mm * std::sin(twice), 0};
  }
};

// Of every stated size.
std::vector<std::string> sizes() {
  std::vector<std::string> names;
  for (const Method* method : allMethods())
    for (const auto& known : method->known)
      if (known.key.ends_with("_mm")) names.push_back(causeName(known.key));
  return names;
}

}  // namespace

std::span<const ErrorKind> errorKinds() {
  const auto lost = causeName(kLostMotionError.key), drift = causeName(kDriftError.key),
             square = causeName(kSquarenessError.key), scale = causeName(kScaleError.key);
  static const std::vector<ErrorKind> kinds{
      {Err::none, "none", ""},
      {Err::lost_motion, "lost motion", "5 um", {lost}, {"lost-motion", "static-error"}},
      {Err::hysteresis, "hysteresis", "1 um", {lost}, {"lost-motion", "static-error", "hysteresis"}},
      {Err::wrong_ball, "wrong ball", "5 um", sizes(), {"static-error"}},
      {Err::drift, "drift", "0.5 um/min", {drift}, {"drift"}},
      {Err::squareness, "squareness", "50 urad", {square}},
      {Err::scale, "scale", "20 ppm", {scale}, {"scale"}},
      {Err::lobing, "lobing", "3 um", {causeName(kLobing)}, {"form-not-of-lobes"}},
      {Err::curvature, "curvature", "1 %", {causeName(metrology::kCurvature)}, {"the probe's gain"}},
      {Err::vibration, "vibration", "1 um", {}, {"vibration", "correlated", "residuals-exceed-noise"}},
      {Err::uneven_screw, "uneven screw", "5 K of 100 mm", {scale}, {"evenly", "scale"}},
      {Err::run_out, "run-out", "2 um twice a turn", {causeName(kErrorMotion)}},
      {Err::outlier, "outlier", "0.05 mm", {}, {"reading-left-out", "dropped", "outlier", "slip", "dirt"}},
      {Err::diameters, "diameters", "X", {}, {"x-in-diameters", "diameters"}},
      {Err::inches, "inches", "all", {}, {"inches"}},
  };
  return kinds;
}

double lobe_mm(const Vector3d& normal) {
  return kLobing_mm * std::hypot(normal.x(), normal.y()) * std::cos(3 * std::atan2(normal.y(), normal.x()));
}

const Column* angleOfC(const Table& table) {
  const auto found = std::ranges::find_if(table.columns, [](const Column& column) {
    return column.name.starts_with("C_") || column.name.starts_with("phi_");
  });
  return found == table.columns.end() ? nullptr : &*found;
}

void disturb(Dataset& dataset, const std::vector<PlacesRead>& places, const Vector3d& about, const Errors& errors,
             Random& random, double right_at_min) {
  const OffAxes axes{errors, random};
  const RunOut run_out{errors, random};
  Vector3d drift = Vector3d::Zero();
  if (errors.has(Err::drift))
    for (double& rate : drift) rate = (uniform(random, 0, 1) < 0.5 ? -errors.size : errors.size) * kDrift_mm_per_min;
  double minute = 0;
  for (const auto& in : places) {
    for (std::size_t row = 0; row < tableNamed(dataset, in.table).rows(); ++row, ++minute) {
      const auto each = [&](const auto& change) {
        for (std::size_t k = 0; k < 3; ++k)
          if (!in.columns.at(k).empty())
            change(static_cast<Index>(k), columnNamed(dataset, in.table, in.columns.at(k))[row]);
      };
      Vector3d at = about;
      each([&](Index k, double value) { at[k] = value; });
      Vector3d off = axes(at - about) + (minute - right_at_min) * drift;
      const Vector3d side = in.side ? in.side(row) : Vector3d::Zero();
      off += atContact(errors, in.side ? &side : nullptr) + run_out.at(angleOfC(tableNamed(dataset, in.table)), row);
      if (errors.has(Err::vibration))
        for (double& value : off) value += gauss(random, errors.size * kVibration_mm);
      each([&](Index k, double& value) { value += off[k]; });
    }
  }
  slip(dataset, places, errors, random);
}

void slip(Dataset& dataset, const std::vector<PlacesRead>& places, const Errors& errors, Random& random) {
  std::vector<double*> readings;
  for (const auto& in : places) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (in.columns.at(k).empty()) continue;
      for (double& value : columnNamed(dataset, in.table, in.columns.at(k))) {
        if (errors.has(Err::diameters) && k == 0) value *= 2;
        if (errors.has(Err::inches)) value /= kInch_mm;
        readings.push_back(&value);
      }
    }
  }
  if (!errors.has(Err::outlier)) return;
  const auto one = std::uniform_int_distribution<std::size_t>{0, readings.size() - 1}(random);
  *readings[one] += uniform(random, 0, 1) < 0.5 ? -kOutlier_mm : kOutlier_mm;
}

}  // namespace probebox::metrology::silent
