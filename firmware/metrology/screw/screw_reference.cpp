#include "firmware/metrology/screw/screw_reference.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_config.hpp"
#include "firmware/metrology/screw/sensor_noise.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr MethodColumn kRestColumns[]{column::kTime, column::kPhi, column::kSensor};
constexpr std::size_t kFewestReadings = 10;
// A screw that is still off by e returns to its room's temperature with a time constant of a quarter of an hour or
// more: at this drift at most 2 um are left.
constexpr double kRestDriftLimitUmS = 0.002;
// A drift of the limit has to show: this many of its standard deviations.
constexpr double kDriftShows = 3.0;

// Error of the face at an angle, with its standard deviation.
struct FaceError {
  double um{};
  double sd_um{};
};

// The face whose means over the sectors are the table, by its harmonics: exact for those below half the number of
// sectors. A mean over a sector takes sin(w)/w off a harmonic, w being half a sector of it. The mean of a table that
// does not sum to 0 is in the face, as in the compensation.
FaceError faceAt(const ScrewModel& screw, double angle_rad, double sd_sector_um) {
  const auto count = static_cast<double>(screw.sector_count);
  FaceError face;
  for (std::size_t i = 0; i < screw.sector_count; ++i) face.um += screw.sector_um[i] / count;
  double variance = 0.0;
  for (std::size_t harmonic = 1; 2 * harmonic < screw.sector_count; ++harmonic) {
    const double turn = static_cast<double>(harmonic) * kTurn / count;
    double cosine = 0.0, sine = 0.0;
    for (std::size_t i = 0; i < screw.sector_count; ++i) {
      const double centre = turn * (static_cast<double>(i) + 0.5);
      cosine += screw.sector_um[i] * std::cos(centre);
      sine += screw.sector_um[i] * std::sin(centre);
    }
    const double gain = 2 / count * (turn / 2) / std::sin(turn / 2);
    const double at = static_cast<double>(harmonic) * angle_rad;
    face.um += gain * (cosine * std::cos(at) + sine * std::sin(at));
    variance += gain * gain * count / 2;
  }
  face.sd_um = sd_sector_um * std::sqrt(variance);
  return face;
}

// The face under the sensor: its table, or how far from plane it may be.
struct FaceUnderSensor {
  ScrewModel screw;  // its sectors
  double sd_um{};    // of a value of the table, or of the face without one
  bool exact{};      // a table without an sd
};

Outcome<FaceUnderSensor, Refusal> restFace(const Dataset& dataset) {
  FaceUnderSensor face;
  TRY(const auto sd_sector, configPositive(dataset, "sd_T_um"));
  TRY(const auto sd_face, configPositive(dataset, "sd_face_um"));
  if (dataset.table("sector_table") == nullptr) {
    if (sd_face) {
      face.sd_um = *sd_face;
      return face;
    }
    return Refusal{
        "missing-key",
        "the face under the sensor is not plane, and one angle does not show its mean: give sector_table from "
        "screw-calibration, or sd_face_um, the standard deviation of the face over a turn"};
  }
  TRY(const auto table, checkedTable(dataset, "sector_table", kSectorColumns));
  if (auto refusal = fillSectors(face.screw, *table, sd_sector.value_or(0.0))) return *refusal;
  face.sd_um = sd_sector.value_or(0.0);
  face.exact = !sd_sector;
  return face;
}

// Smallest difference between two readings that are not equal; nothing when all are equal.
std::optional<double> smallestStep(std::vector<double> readings) {
  std::ranges::sort(readings);
  std::optional<double> smallest;
  for (std::size_t k = 1; k < readings.size(); ++k) {
    const double step = readings[k] - readings[k - 1];
    if (step > 0 && (!smallest || step < *smallest)) smallest = step;
  }
  return smallest;
}

// Parameters: reading at the mean time without the face, drift.
struct RestFit {
  Fit fit;
  Eigen::MatrixXd design;
  double face_sd_um{};
};

Outcome<RestFit, Refusal> fitRest(const Table& table, const FaceUnderSensor& face) {
  const auto& times = *table.column(column::kTime);
  const auto& angles = *table.column(column::kPhi);
  const auto& sensor = *table.column(column::kSensor);
  const auto rows = static_cast<Eigen::Index>(table.rows());
  double mean_s = 0.0;
  for (const double t : times) mean_s += t / static_cast<double>(times.size());
  Eigen::MatrixXd design{rows, 2};
  Eigen::VectorXd values{rows};
  double face_sd = face.sd_um;
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    const auto error = face.screw.sector_count == 0 ? FaceError{} : faceAt(face.screw, angles[row], face.sd_um);
    if (face.screw.sector_count != 0) face_sd = k == 0 ? error.sd_um : std::max(face_sd, error.sd_um);
    design.row(k) << 1.0, times[row] - mean_s;
    values[k] = sensor[row] - error.um;
  }
  TRY(auto fit, linearLeastSquares(design, values));
  return RestFit{std::move(fit), std::move(design), face_sd};
}

std::optional<Refusal> notAtRest(double drift, double sd_drift, double limit) {
  if (kDriftShows * sd_drift > limit) {
    return Refusal{"too-few-samples", "the drift is known to " + text(sd_drift) +
                                          " um/s, and has to be to a third of the limit of " + text(limit) +
                                          " um/s: stand still for longer, or read the sensor more often"};
  }
  if (std::abs(drift) <= limit) return std::nullopt;
  return Refusal{"not-steady", "the sensor drifts by " + text(drift) + " um/s, more than " + text(limit) +
                                   ": the screw is not cold yet; let the machine stand, and measure again"};
}

}  // namespace

Outcome<Result, Refusal> solveScrewReference(const Dataset& dataset) {
  TRY(const auto limit, configPositive(dataset, "drift_limit_um_s"));
  TRY(const auto resolution, configPositive(dataset, "resolution_um"));
  TRY(const auto face, restFace(dataset));
  TRY(const auto table, checkedTable(dataset, "at_rest", kRestColumns));
  if (table->rows() < kFewestReadings) {
    return Refusal{"too-few-samples", "table 'at_rest' has " + std::to_string(table->rows()) +
                                          " readings, fewer than 10: stand still for longer"};
  }
  const auto& times = *table->column(column::kTime);
  if (const auto back = std::ranges::adjacent_find(times, std::ranges::greater_equal{}); back != times.end()) {
    return Refusal{"time-not-rising", "table 'at_rest', row " + std::to_string(back - times.begin() + 2) +
                                          ": t_s does not rise, as of a copied row: remove it"};
  }
  const auto step = resolution ? resolution : smallestStep(*table->column(column::kSensor));
  if (!step) {
    return Refusal{"constant-sensor",
                   "all readings of the sensor are equal: it is frozen, or its resolution hides the noise; check it, "
                   "or state resolution_um"};
  }
  TRY(const auto rest, fitRest(*table, face));
  const double inflation = SensorNoise{rest.fit, rest.design}.ofAll();
  Answer answer{dataset, rest.fit, {}};
  const double sd_reading = answer.readingSd().value_or(0.0);
  const Eigen::Matrix2d all = Eigen::Matrix2d::Identity();
  const double sd_drift = answer.sdOf(all.row(1)).value_or(0.0) * std::sqrt(inflation);
  if (auto refusal = notAtRest(rest.fit.parameters[1], sd_drift, limit.value_or(kRestDriftLimitUmS))) return *refusal;

  answer.readingIs("one reading of the sensor", "um");
  answer.readings(*table, {column::kSensor}, column::kTime);
  answer.promiseScalar(quantity::kColdReading, rest.fit.parameters[0], all.row(0));
  answer.promiseScalar(quantity::kSensorDrift, rest.fit.parameters[1], all.row(1));
  Result result = std::move(answer).take(true);
  const double added = std::hypot(rest.face_sd_um, roundingSd(sd_reading, *step));
  for (const auto key : {quantity::kColdReading.key, quantity::kSensorDrift.key}) inflate(result, key, inflation);
  for (double& sd : result.estimates.front().sd) sd = std::hypot(sd, added);
  if (result.covariance) result.covariance->values.front() += added * added;
  if (inflation > 1) result.warnings.push_back(correlatedWarning(text(std::sqrt(inflation))));
  if (face.exact) {
    result.warnings.emplace_back(
        "sd_T_um is not stated: the values of sector_table count as exact; state that of screw-calibration");
  }
  result.convention = "reading of the cold screw at the mean time, without the error of the face there; rms in um";
  return result;
}

namespace {

constexpr MethodTable kReferenceTables[]{{"at_rest", kRestColumns, "a reading of the cold screw at rest"},
                                         {"sector_table", kSectorColumns, "a sector of the calibrated face table"}};
constexpr MethodKey kReferenceKeys[]{
    {"sd_T_um", "0", "standard deviation of a value of sector_table (k = 1)"},
    {"sd_face_um", "", "instead of table sector_table: standard deviation of the face over a turn (k = 1)"},
    {"drift_limit_um_s", "0.002", "more drift is refused"},
    {"resolution_um", "", "of a reading; without it the smallest difference between two"},
    {"axis", "", "axis of the screw, X, Y or Z; needed by the box"},
    {"screw_result", "", "number of the face table's result; for the record", SubjectKind::screw}};
constexpr Quantity kReferenceResults[]{quantity::kColdReading,
                                       quantity::kSensorDrift.as("drift of the sensor during at_rest")};
constexpr std::string_view kReferenceUnobservable[]{
    "whether the screw is at the temperature at which the machine is right: a screw that is evenly warm is as steady",
    "a drift of the sensor itself, which looks like an extension"};

std::optional<Subject> subjectOfReference(const Dataset& dataset) {
  return letteredSubject(dataset, SubjectKind::screw_reference);
}

}  // namespace

const Method kScrewReference{.name = "screw-reference",
                             .title = "Reading of a cold ball screw's sensor",
                             .equations = "(D7)",
                             .source = source::kScrew,
                             .solver = solveScrewReference,
                             .tables = kReferenceTables,
                             .keys = kReferenceKeys,
                             .results = kReferenceResults,
                             .unobservable = kReferenceUnobservable,
                             .subject = {.of = subjectOfReference}};

}  // namespace probebox::metrology
