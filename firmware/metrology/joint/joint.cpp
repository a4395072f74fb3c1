#include "firmware/metrology/joint/joint.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/metrology/screw/screw_config.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr MethodColumn kJointColumns[]{
    column::kReadAt, column::kBall, column::kC, column::kNormalX, column::kNormalY, column::kNormalZ, column::kSpeed,
    column::kX,      column::kY,    column::kZ, kExtensions[0],   kExtensions[1],   kExtensions[2]};
constexpr std::size_t kNeededColumns = 10;
constexpr MethodKey kLengths[]{{"screw_length_x_mm", "", "of the screw of X, from the fixed bearing to the sensor"},
                               {"screw_length_y_mm", "", "the same of Y"},
                               {"screw_length_z_mm", "", "the same of Z"}};
constexpr MethodKey kOffsets[]{{"orgoff_x_mm", "", "of the screw of X, from the fixed bearing to the axis zero"},
                               {"orgoff_y_mm", "", "the same of Y"},
                               {"orgoff_z_mm", "", "the same of Z"}};
constexpr MethodKey kReversed[]{
    {"axis_reversed_x", "false", "true if X counts upwards towards the fixed bearing of its screw"},
    {"axis_reversed_y", "false", "the same of Y"},
    {"axis_reversed_z", "false", "the same of Z"}};
constexpr MethodKey kGainsInUse[]{{"gain_x", "", "K of the screw of X that is in use, to be compared"},
                                  {"gain_y", "", "the same of Y"},
                                  {"gain_z", "", "the same of Z"}};
constexpr MethodKey kKnownDiameter{"effective_diameter_mm", "", "of ball plus stylus ball, where it is known"};

// Least eigenvalue of the correlations of the unknowns' columns: below it two of them are seen as one, which makes an
// sd a hundred times that of an unknown alone.
constexpr double kSeparable = 1e-4;

// One touch.
struct JointTouch {
  double minutes{};  // from the mean time
  std::size_t ball{};
  double stop{};           // of C: touches of one share its error
  Eigen::Matrix2d turned;  // by C
  Vector3d normal, at_mm;
  double speed_mm_s{};
  Vector3d stretch_mm;  // of each screw at the nut for a gain of 1
};

struct Shift {
  std::vector<JointTouch> touches;
  std::vector<double> heights;  // mean of the touches of each ball, mm
  double mean_z_mm{};
  std::array<bool, 3> has_screw{};
  std::optional<double> radius_mm;
  Sigma sigma;
  double sigma_c_rad{};  // of a stop
};

// Nothing of an axis whose extension nobody read.
Outcome<std::optional<ScrewModel>, Refusal> screwOfAxis(const Dataset& dataset, const Table& table, std::size_t axis) {
  const auto* extension = table.column(kExtensions[axis]);
  if (extension == nullptr) return std::optional<ScrewModel>{};
  const auto [least, greatest] = std::ranges::minmax(*extension);
  if (greatest - least < kLeastExtension_um) {
    return Refusal{"extension-span-too-small", "the extensions in column '" + std::string{kExtensions[axis]} +
                                                   "' span " + text(greatest - least) +
                                                   " um, less than 5: touch while the screw warms, or omit the column"};
  }
  ScrewModel screw;
  TRY(screw.length_mm, requiredPositive(dataset, kLengths[axis].name));
  TRY(screw.offset_mm, requiredNumber(dataset, kOffsets[axis].name));
  TRY(screw.reversed, configSwitch(dataset, kReversed[axis].name));
  if (auto refusal = refuseOutside(screw, table, column::kPosition[axis])) return *refusal;
  return std::optional{screw};
}

Outcome<Shift, Refusal> shiftOf(const Dataset& dataset) {
  Shift shift;
  TRY(shift.sigma, configSigma(dataset, key::kSigma.name));
  TRY(const auto diameter, configPositive(dataset, kKnownDiameter.name));
  if (diameter) shift.radius_mm = *diameter / 2;
  TRY(const auto sigma_c_rad, configPositive(dataset, key::kSigmaC.name));
  shift.sigma_c_rad = sigma_c_rad.value_or(0);
  TRY(const auto sense, configSense(dataset, key::kCSense.name));
  const Table* given = dataset.table("readings");
  std::vector<std::string_view> names;
  for (const auto& column : kJointColumns) {
    const bool is_extension = names.size() >= kNeededColumns;
    if (is_extension && (given == nullptr || given->column(column) == nullptr)) continue;
    names.push_back(column);
  }
  TRY(const auto table, checkedTable(dataset, "readings", names));
  std::array<std::optional<ScrewModel>, 3> screws;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TRY(screws[axis], screwOfAxis(dataset, *table, axis));
    shift.has_screw[axis] = screws[axis].has_value();
  }
  const auto& times = *table->column(column::kReadAt);
  double mean_s = 0;
  for (const double time : times) mean_s += time / static_cast<double>(times.size());
  std::map<double, std::size_t> balls;
  std::vector<double> counts;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*table->column(kJointColumns[k]))[row]; };
    JointTouch touch;
    touch.minutes = (times[row] - mean_s) / 60;
    touch.ball = balls.try_emplace(value(1), balls.size()).first->second;
    const auto& angles = *table->column(column::kC);
    const bool is_turned = row > 0 && std::abs(angles[row] - angles[row - 1]) > kSameStop_rad;
    touch.stop = row == 0 ? 0 : shift.touches.back().stop + (is_turned ? 1 : 0);
    touch.turned = Eigen::Rotation2Dd{sense * value(2)}.toRotationMatrix();
    touch.normal = Vector3d{value(3), value(4), value(5)};
    touch.speed_mm_s = value(6);
    touch.at_mm = Vector3d{value(7), value(8), value(9)};
    if (std::abs(touch.normal.norm() - 1) > 1e-3) {
      return Refusal{"bad-direction", "table 'readings', row " + std::to_string(row + 1) +
                                          ": nx, ny, nz are not a unit vector: give the outward normal"};
    }
    touch.stretch_mm.setZero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Index>(axis);
      if (screws[axis])
        touch.stretch_mm[at] =
            1e-3 * leverOf(*screws[axis], touch.at_mm[at]) * (*table->column(kExtensions[axis]))[row];
    }
    shift.heights.resize(balls.size());
    counts.resize(balls.size());
    shift.heights[touch.ball] += touch.at_mm.z();
    counts[touch.ball] += 1;
    shift.touches.push_back(touch);
  }
  for (std::size_t ball = 0; ball < counts.size(); ++ball) {
    shift.heights[ball] /= counts[ball];
    shift.mean_z_mm += shift.heights[ball] / static_cast<double>(counts.size());
  }
  return shift;
}

// Places of the unknowns, and what each is called.
class JointModel {
 public:
  explicit JointModel(const Shift& shift) : shift_{shift} {
    delay_ = add({"the delay"});
    if (!shift.radius_mm) size_ = add({"the size"});
    centre_ = add({"the place of the axis in X", "the place of the axis in Y"});
    tilt_ = add({"the tilt of the axis in X", "the tilt of the axis in Y"});
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (shift.has_screw[axis]) gains_[axis] = add({"the gain of the screw of " + axisName(axis)});
    drift_ = add({"the drift of X", "the drift of Y", "the drift of Z"});
    balls_ = size();
    for (std::size_t ball = 1; ball <= shift.heights.size(); ++ball) {
      const auto name = "the place of ball " + std::to_string(ball) + " of the case in ";
      add({name + "X", name + "Y", name + "Z"});
    }
  }

  Index size() const { return static_cast<Index>(names_.size()); }
  Index delay() const { return delay_; }
  Index centre() const { return centre_; }
  Index tilt() const { return tilt_; }
  Index drift() const { return drift_; }
  std::optional<Index> diameter() const { return size_; }
  std::optional<Index> gain(std::size_t axis) const { return gains_[axis]; }
  const std::string& name(Index unknown) const { return names_[static_cast<std::size_t>(unknown)]; }

  // Balls at the heights of their touches, everything else at nothing.
  VectorXd start() const {
    VectorXd at = VectorXd::Zero(size());
    for (std::size_t ball = 0; ball < shift_.heights.size(); ++ball)
      at[balls_ + 3 * static_cast<Index>(ball) + 2] = shift_.heights[ball] - shift_.mean_z_mm;
    return at;
  }

  // (G1)
  Linearised operator()(const VectorXd& at) const {
    const auto rows = static_cast<Index>(shift_.touches.size());
    Linearised model{VectorXd{rows}, MatrixXd::Zero(rows, size())};
    for (Index row = 0; row < rows; ++row) {
      const auto& touch = shift_.touches[static_cast<std::size_t>(row)];
      const Vector3d& n = touch.normal;
      auto by = model.jacobian.row(row);
      const Index ball = balls_ + 3 * static_cast<Index>(touch.ball);
      const Eigen::Vector2d arm = touch.turned * at.segment<2>(ball), tilt = at.segment<2>(tilt_);
      const double height = at[ball + 2];
      const Vector3d place{at[centre_] + tilt.x() * height + arm.x(), at[centre_ + 1] + tilt.y() * height + arm.y(),
                           shift_.mean_z_mm + height - tilt.dot(arm)};
      by.segment<2>(centre_) = n.head<2>();
      by.segment<2>(tilt_) = height * n.head<2>() - n.z() * arm;
      by.segment<2>(ball) = (n.head<2>() - n.z() * tilt).transpose() * touch.turned;
      by[ball + 2] = n.z() + tilt.dot(n.head<2>());
      double found = n.dot(place - touch.at_mm) + shift_.radius_mm.value_or(0) - touch.speed_mm_s * at[delay_];
      by[delay_] = -touch.speed_mm_s;
      if (size_) {
        found += at[*size_];
        by[*size_] = 1;
      }
      for (Index axis = 0; axis < 3; ++axis) {
        const auto gain = gains_[static_cast<std::size_t>(axis)];
        found += n[axis] * touch.minutes * at[drift_ + axis];
        by[drift_ + axis] = n[axis] * touch.minutes;
        if (!gain) continue;
        found -= n[axis] * touch.stretch_mm[axis] * at[*gain];
        by[*gain] = -n[axis] * touch.stretch_mm[axis];
      }
      model.residuals[row] = found / shift_.sigma.value;
    }
    model.jacobian /= shift_.sigma.value;
    if (shift_.sigma_c_rad > 0) shareStops(model, at);
    return model;
  }

 private:
  void shareStops(Linearised& model, const VectorXd& at) const {
    VectorXd moved{model.residuals.size()};
    std::vector<double> stops;
    for (Index row = 0; row < moved.size(); ++row) {
      const auto& touch = shift_.touches[static_cast<std::size_t>(row)];
      const Eigen::Vector2d arm = touch.turned * at.segment<2>(balls_ + 3 * static_cast<Index>(touch.ball));
      moved[row] = touch.normal.head<2>().dot(Eigen::Vector2d{-arm.y(), arm.x()}) * shift_.sigma_c_rad;
      stops.push_back(touch.stop);
    }
    shareErrors(model.jacobian, model.residuals, moved / shift_.sigma.value, stops);
  }
  Index add(const std::vector<std::string>& names) {
    const Index first = size();
    names_.insert(names_.end(), names.begin(), names.end());
    return first;
  }

  const Shift& shift_;
  std::vector<std::string> names_;
  Index delay_{}, centre_{}, tilt_{}, drift_{}, balls_{};
  std::optional<Index> size_;
  std::array<std::optional<Index>, 3> gains_;
};

// Solved as if the axis stood upright, then with its tilt.
VectorXd uprightOf(const JointModel& model) {
  VectorXd at = model.start();
  auto linear = model(at);
  linear.jacobian.middleCols<2>(model.tilt()).setZero();
  const VectorXd off = linear.residuals;
  at -= solveLeastSquares(linear.jacobian, off);
  return at;
}

// Unknowns that the readings see as one, by their names.
std::optional<Refusal> notSeparable(const JointModel& model, const VectorXd& at) {
  const MatrixXd jacobian = model(at).jacobian;
  std::vector<std::string> names;
  const VectorXd norms = jacobian.colwise().norm();
  for (Index k = 0; k < norms.size(); ++k)
    if (!(norms[k] > 0)) names.push_back(model.name(k));
  if (names.empty()) {
    const MatrixXd scaled = jacobian * norms.cwiseInverse().asDiagonal();
    const auto axes = symmetricEigen(scaled.transpose() * scaled);
    if (axes.values[0] >= kSeparable) return std::nullopt;
    constexpr double kNamed = 0.3;  // of the largest share of the direction that nobody sees
    const VectorXd shares = axes.vectors.col(0).cwiseAbs();
    for (Index k = 0; k < shares.size(); ++k)
      if (shares[k] > kNamed * shares.maxCoeff()) names.push_back(model.name(k));
  }
  std::string all;
  for (const auto& name : names) all += (all.empty() ? "" : ", ") + name;
  return Refusal{
      "not-separable",
      "these readings do not tell apart " + all +
          ": touch at two speeds or state effective_diameter_mm for the delay, from all sides at several C "
          "and Z for the axis, and for gain and drift as long as the screws take to warm or cool (let the axes work "
          "between the turns of a run); or omit the column of an extension"};
}

void promise(Answer& answer, const Shift& shift, const JointModel& model, const VectorXd& at) {
  const Index size = model.size();
  constexpr double kUmPerMm = 1e3;
  answer.promiseScalar(quantity::kTau, at[model.delay()], pick(model.delay(), 1, size).row(0));
  answer.promiseVector(quantity::kCentre, at.segment<2>(model.centre()), pick(model.centre(), 2, size));
  answer.promiseVector(quantity::kCTilt, at.segment<2>(model.tilt()), pick(model.tilt(), 2, size));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (const auto gain = model.gain(axis))
      answer.promiseScalar(quantity::kGains[axis], at[*gain], pick(*gain, 1, size).row(0));
  }
  answer.promiseVector(quantity::kDriftRate, kUmPerMm * at.segment<3>(model.drift()),
                       kUmPerMm * pick(model.drift(), 3, size));
  if (const auto radius = model.diameter())
    answer.alsoScalar(quantity::kEffectiveDiameter, 2 * at[*radius], 2 * pick(*radius, 1, size).row(0));
  answer.result().also.push_back(Estimate::scalar(quantity::kMeanHeight, shift.mean_z_mm, std::nullopt));
  answer.result().convention =
      "centre_mm is where the axis is at mean_z_mm and at the mean time; positions are P - K lever extension + drift";
}

// Warns of a gain that is not the one in use.
std::optional<Refusal> compareGains(const Dataset& dataset, Result& result) {
  constexpr double kMost_sd = 4;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TRY(const auto in_use, configNumber(dataset, kGainsInUse[axis].name));
    const auto* found = result.find(quantity::kGains[axis].key);
    if (!in_use || found == nullptr || found->sd.empty()) continue;
    if (std::abs(found->value() - *in_use) <= kMost_sd * found->sd.front()) continue;
    result.warnings.push_back("screw-gain: the screw of " + std::string(1, "XYZ"[axis]) + " moves its nut by " +
                              text(found->value()) + " +/- " + text(found->sd.front()) + " of its extension, and " +
                              text(*in_use) + " is in use: state it as gain of [screw." + std::string(1, "XYZ"[axis]) +
                              "] in machine.toml (gain_is = \"error\"), or look for a screw that is not evenly warm");
  }
  return std::nullopt;
}

}  // namespace

Outcome<Result, Refusal> solveJoint(const Dataset& dataset) {
  TRY(const auto shift, shiftOf(dataset));
  const JointModel model{shift};
  const VectorXd upright = uprightOf(model);
  if (auto refusal = notSeparable(model, upright)) return *refusal;
  TRY(const auto fit, leastSquares(model, upright));
  Answer answer{dataset, fit, shift.sigma};
  answer.readingIs("one touch, along its normal", "mm");
  std::vector<std::string> names;
  for (std::size_t row = 1; row <= shift.touches.size(); ++row) names.push_back("readings " + std::to_string(row));
  answer.readings(names, *dataset.table("readings")->column(column::kReadAt), column::kReadAt);
  promise(answer, shift, model, fit.parameters);
  Result result = std::move(answer).take(true);
  if (auto refusal = compareGains(dataset, result)) return *refusal;
  return result;
}

namespace {

constexpr MethodTable kJointTables[]{
    {"readings", kJointColumns,
     "a touch of a ball on the table: the machine's position where the deflection is zero, with the delay still in it, "
     "the outward normal, and the speed along it, positive on the way out; ext_x_um and so on where the extension of a "
     "screw was read",
     true}};
constexpr MethodKey kJointKeys[]{key::kSigma,  key::kSigmaC,   kKnownDiameter, key::kCSense,
                                 kLengths[0],  kLengths[1],    kLengths[2],    kOffsets[0],
                                 kOffsets[1],  kOffsets[2],    kReversed[0],   kReversed[1],
                                 kReversed[2], kGainsInUse[0], kGainsInUse[1], kGainsInUse[2]};
constexpr KnownQuantity kJointKnown[]{
    {"sd_effective_diameter_mm", kKnownDiameter.name, KnownKind::size, false, "certificate of the sphere"}};
constexpr Quantity kJointResults[]{quantity::kTau,      quantity::kCentre.as("place of the C axis at mean_z_mm, x y"),
                                   quantity::kCTilt,    quantity::kGains[0],
                                   quantity::kGains[1], quantity::kGains[2],
                                   quantity::kDriftRate};
constexpr Quantity kJointFurther[]{quantity::kEffectiveDiameter, quantity::kMeanHeight};
constexpr std::string_view kJointUnobservable[]{
    "drift of the machine separately from that of the probe's zero",
    "a delay of one axis, or lost motion, separately from the size and the common delay"};

}  // namespace

const Method kJoint{.name = "joint",
                    .title = "Delay, turning axis, screws and drift together",
                    .equations = "(G1)",
                    .source = "the model of sections A, B and D",
                    .solver = solveJoint,
                    .tables = kJointTables,
                    .keys = kJointKeys,
                    .known = kJointKnown,
                    .results = kJointResults,
                    .further = kJointFurther,
                    .unobservable = kJointUnobservable};

}  // namespace probebox::metrology
