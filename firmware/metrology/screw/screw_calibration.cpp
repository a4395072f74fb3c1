#include "firmware/metrology/screw/screw_calibration.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/block_least_squares.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/metrology/screw/gain_check.hpp"
#include "firmware/metrology/screw/heat_by_travel.hpp"
#include "firmware/metrology/screw/screw_config.hpp"
#include "firmware/metrology/screw/sensor_noise.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {
namespace {

// A linear fit without its spikes, the rows in fit.dropped.
struct SpikeFreeFit {
  Fit fit;
  bool too_many{};  // more than single samples are: all rows are in use
};

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDeviations = 4.5;  // as in scans
constexpr double kDigits = 2.0;
constexpr double kMostShare = 0.02;  // of the rows
constexpr int kMostRounds = 10;

double finestDigit(const VectorXd& values) {
  double digit = 1.0;
  for (const double value : values) digit = std::min(digit, digitOf(value));
  return digit;
}

// Largest residual of every group beyond the limit, of those in use. Rows, in no order.
std::vector<std::size_t> worstRows(const VectorXd& residuals, const std::vector<bool>& in_use,
                                   const std::vector<std::size_t>& group, double digit) {
  std::vector<double> sizes;
  for (std::size_t row = 0; row < in_use.size(); ++row)
    if (in_use[row]) sizes.push_back(std::abs(residuals[static_cast<Index>(row)]));
  const double limit = std::max(kDeviations * 1.4826 * median(sizes), kDigits * digit);
  std::map<std::size_t, std::pair<double, std::size_t>> worst;
  for (std::size_t row = 0; row < in_use.size(); ++row) {
    const double size = std::abs(residuals[static_cast<Index>(row)]);
    if (!in_use[row] || size <= limit) continue;
    auto& of_group = worst[group[row]];
    of_group = std::max(of_group, {size, row});
  }
  std::vector<std::size_t> rows;
  for (const auto& [_, found] : worst) rows.push_back(found.second);
  return rows;
}

// The linear fit of some rows, with the residuals of all. Columns that are not zero in the rows of one group alone are
// eliminated with it, so that work and memory grow with the rows. group: of each row.
Outcome<Fit, Refusal> fitOf(const Eigen::MatrixXd& design, const VectorXd& values,
                            const std::vector<std::size_t>& group, const std::vector<bool>& in_use) {
  const std::size_t groups = std::ranges::max(group) + 1;
  std::vector<std::vector<std::size_t>> rows(groups);
  std::vector<std::size_t> dropped;
  for (std::size_t row = 0; row < group.size(); ++row) (in_use[row] ? rows[group[row]] : dropped).push_back(row);
  std::vector<Index> common;
  std::vector<std::vector<Index>> own(groups);
  for (Index column = 0; column < design.cols(); ++column) {
    std::size_t first = groups, last = 0;
    for (std::size_t row = 0; row < group.size(); ++row) {
      if (design(static_cast<Index>(row), column) == 0) continue;
      first = std::min(first, group[row]);
      last = std::max(last, group[row]);
    }
    (first == last ? own[first] : common).push_back(column);
  }
  BlockUnknowns start{VectorXd::Zero(std::ssize(common)), {}};
  for (const auto& columns : own) start.own.emplace_back(VectorXd::Zero(std::ssize(columns)));
  const BlockModel model = [&](std::size_t block, const BlockUnknowns& at) {
    if (block == groups) return BlockRows{VectorXd{0}, MatrixXd{0, 0}, MatrixXd{0, std::ssize(common)}};
    BlockRows found{-values(rows[block]), design(rows[block], own[block]), design(rows[block], common)};
    found.residuals += found.own * at.own[block] + found.common * at.common;
    return found;
  };
  TRY(const auto blocks, leastSquaresInBlocks(model, start));

  Fit fit;
  fit.dof = blocks.dof;
  fit.condition = blocks.condition;
  fit.parameters.resize(design.cols());
  fit.parameters(common) = blocks.unknowns.common;
  // Of every unknown its change with the common ones.
  MatrixXd carried = MatrixXd::Zero(design.cols(), std::ssize(common));
  carried(common, Eigen::all).setIdentity();
  for (std::size_t k = 0; k < groups; ++k) {
    fit.parameters(own[k]) = blocks.unknowns.own[k];
    carried(own[k], Eigen::all) = blocks.cofactor.carried[k];
  }
  fit.cofactor = carried * blocks.cofactor.common * carried.transpose();
  for (std::size_t k = 0; k < groups; ++k) fit.cofactor(own[k], own[k]) += blocks.cofactor.own[k];
  fit.residuals = design * fit.parameters - values;
  fit.dropped = std::move(dropped);
  return fit;
}

// Fits as linearLeastSquares does and drops rows that are more than 4.5 deviations (and two digits of the values) off,
// of every group the worst at a time: a spike pulls the others of its group. group: of each row.
Outcome<SpikeFreeFit, Refusal> fitWithoutSpikes(const Eigen::MatrixXd& design, const VectorXd& values,
                                                const std::vector<std::size_t>& group) {
  std::vector<bool> in_use(group.size(), true);
  TRY(const auto all, fitOf(design, values, group, in_use));
  Fit fit = all;
  const double digit = finestDigit(values);
  for (int round = 0;; ++round) {
    const auto worst = worstRows(fit.residuals, in_use, group, digit);
    if (worst.empty()) return SpikeFreeFit{std::move(fit), false};
    const auto dropped = static_cast<double>(fit.dropped.size() + worst.size());
    if (round == kMostRounds || dropped > std::max(1.0, kMostShare * static_cast<double>(group.size())))
      return SpikeFreeFit{all, true};
    for (const auto row : worst) in_use[row] = false;
    auto again = fitOf(design, values, group, in_use);
    if (!again) return SpikeFreeFit{all, true};
    fit = std::move(again).value();
  }
}

constexpr MethodColumn kGainColumns[]{column::kSetX, kExtension, kNutError};
constexpr MethodColumn kGainTableColumns[]{column::kSetX, kExtension, kNutError, column::kReadAt.orBe(MayBe::missing)};
constexpr MethodColumn kFaceColumns[]{column::kTime, column::kPhi.as(ColumnRole::rotation), column::kSensor};
constexpr const char* kStandingGain = "K";
constexpr std::size_t kLeastSamples = 10;
constexpr double kLeastTurns = 3.0;
constexpr double kDriftLimitUmS = 0.1;
// Deviation of the places inside a sector, in sector widths (0.29 when evenly spread), below which all samples count as
// taken at one place and tell no slope.
constexpr double kOnePlace = 0.1;
constexpr double kEnoughForCurves = 30.0;  // samples a sector

Outcome<Fit, Refusal> fitGain(const Table& table, const ScrewModel& screw) {
  const auto& positions = *table.column(column::kX);
  const auto& extensions = *table.column(kExtension);
  const auto& errors = *table.column(kNutError);
  const auto [least, greatest] = std::ranges::minmax(extensions);
  if (greatest - least < kLeastExtension_um) {
    return Refusal{"extension-span-too-small", "the extensions span " + text(greatest - least) + " um, less than " +
                                                   text(kLeastExtension_um) +
                                                   ": warm the screw further between the readings"};
  }
  const auto rows = static_cast<Eigen::Index>(table.rows());
  Eigen::MatrixXd design{rows, 1};
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    design(k, 0) = leverOf(screw, positions[row]) * extensions[row];
  }
  return linearLeastSquares(design, Eigen::Map<const Eigen::VectorXd>{errors.data(), rows});
}

// The samples of a slow rotation: in which sector, and where inside it (-0.5 to 0.5 widths).
struct Face {
  std::size_t sectors{};
  std::vector<std::size_t> sector;
  std::vector<double> place;
  std::vector<double> time;  // s, about the mean
  const std::vector<double>* sensor{};
};

Face faceOf(const Table& table, std::size_t sectors) {
  Face face{.sectors = sectors, .sector = {}, .place = {}, .time = *table.column(column::kTime), .sensor = nullptr};
  for (const double angle : *table.column(column::kPhi)) {
    const std::size_t sector = sectorAt(angle, sectors);
    const double turns = angle / kTurn;
    face.sector.push_back(sector);
    face.place.push_back((turns - std::floor(turns)) * static_cast<double>(sectors) - static_cast<double>(sector) -
                         0.5);
  }
  double mean = 0.0;
  for (const double t : face.time) mean += t / static_cast<double>(face.time.size());
  for (double& t : face.time) t -= mean;
  face.sensor = table.column(column::kSensor);
  return face;
}

std::optional<Refusal> tooLittle(const Face& face, const std::vector<double>& angles) {
  std::vector<std::size_t> counts(face.sectors, 0);
  for (const auto sector : face.sector) ++counts[sector];
  for (std::size_t sector = 0; sector < face.sectors; ++sector) {
    const std::string where = "sector " + std::to_string(sector) + " of " + std::to_string(face.sectors);
    if (counts[sector] == 0) {
      return Refusal{"empty-sector", where + " has no sample: turn the screw through whole turns, slowly"};
    }
    if (counts[sector] < kLeastSamples) {
      return Refusal{"too-few-samples", where + " has " + std::to_string(counts[sector]) +
                                            " samples, fewer than 10: turn more slowly or more often"};
    }
  }
  double turned = 0.0;
  for (std::size_t k = 1; k < angles.size(); ++k) turned += std::remainder(angles[k] - angles[k - 1], kTurn) / kTurn;
  // The last sample of a whole turn stands one step before its end.
  const double step = std::abs(turned) / static_cast<double>(angles.size() - 1);
  if (std::abs(turned) + 1.5 * step < kLeastTurns) {
    return Refusal{"too-few-turns", "the screw turned " + text(std::abs(turned)) +
                                        " times: separating the drift from the face run-out needs 3 whole turns"};
  }
  return std::nullopt;
}

// Degree of the polynomial that the face follows inside a sector: what its samples can tell.
int degreeOf(const Face& face) {
  std::vector<double> count(face.sectors, 0.0);
  std::vector<double> sum(face.sectors, 0.0);
  std::vector<double> squares(face.sectors, 0.0);
  for (std::size_t k = 0; k < face.sector.size(); ++k) {
    count[face.sector[k]] += 1.0;
    sum[face.sector[k]] += face.place[k];
    squares[face.sector[k]] += face.place[k] * face.place[k];
  }
  for (std::size_t s = 0; s < face.sectors; ++s) {
    const double mean = sum[s] / count[s];
    if (squares[s] / count[s] - mean * mean < kOnePlace * kOnePlace) return 0;
  }
  return std::ranges::min(count) < kEnoughForCurves ? 1 : 2;
}

// Parameters: mean of each sector, drift, how the drift changes, then slope and curvature of each sector. The
// polynomials are those of Legendre, so the mean over the sector is the first parameter alone. A screw that approaches
// its temperature drifts less and less, and the bend of that would be in the residuals.
struct FaceFit {
  Fit fit;
  Eigen::MatrixXd design;
  bool many_spikes{};

  // Without the samples that were dropped, where there are any.
  FaceFit kept() const {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index row = 0; row < design.rows(); ++row)
      if (!std::ranges::binary_search(fit.dropped, static_cast<std::size_t>(row))) rows.push_back(row);
    FaceFit some = *this;
    some.fit.residuals = fit.residuals(rows);
    some.design = design(rows, Eigen::all);
    return some;
  }
};

Outcome<FaceFit, Refusal> fitFace(const Face& face) {
  const auto sectors = static_cast<Eigen::Index>(face.sectors);
  const auto rows = static_cast<Eigen::Index>(face.sector.size());
  const int degree = degreeOf(face);
  double mean_square = 0.0;
  for (const double t : face.time) mean_square += t * t / static_cast<double>(face.time.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, sectors * (degree + 1) + 2);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    const auto sector = static_cast<Eigen::Index>(face.sector[row]);
    const double place = face.place[row];
    design(k, sector) = 1.0;
    design(k, sectors) = face.time[row];
    design(k, sectors + 1) = face.time[row] * face.time[row] - mean_square;
    if (degree > 0) design(k, sectors + 2 + sector) = place;
    if (degree > 1) design(k, 2 * sectors + 2 + sector) = place * place - 1.0 / 12.0;
  }
  TRY(auto found, fitWithoutSpikes(design, Eigen::Map<const Eigen::VectorXd>{face.sensor->data(), rows}, face.sector));
  return FaceFit{std::move(found.fit), std::move(design), found.too_many};
}

// One past the last sample of every passage of the sensor over a sector, of the samples in use.
std::vector<Eigen::Index> passagesOf(const Face& face, const std::vector<std::size_t>& dropped) {
  std::vector<std::size_t> sectors;
  for (std::size_t k = 0; k < face.sector.size(); ++k)
    if (!std::ranges::binary_search(dropped, k)) sectors.push_back(face.sector[k]);
  std::vector<Eigen::Index> ends;
  for (std::size_t k = 1; k <= sectors.size(); ++k) {
    if (k == sectors.size() || sectors[k] != sectors[k - 1]) ends.push_back(static_cast<Eigen::Index>(k));
  }
  return ends;
}

void nameSpikes(Result& result, const FaceFit& of_face) {
  for (const auto row : of_face.fit.dropped)
    result.dropped.push_back({"sector_cal " + std::to_string(row + 1), "more than 4.5 deviations from the others"});
  if (!of_face.many_spikes) return;
  result.warnings.emplace_back(
      "sector_cal: many samples are more than 4.5 deviations off, and none is left out: look for interference of the "
      "sensor, or a screw that did not turn evenly");
}

// A sector is read for a short time in each turn, the drift is seen over all of them.
void widen(Result& result, const FaceFit& of_face, const Face& face) {
  const bool is_whole = of_face.fit.dropped.empty();
  const FaceFit some = is_whole ? FaceFit{} : of_face.kept();  // large tables are not copied without need
  const FaceFit& kept = is_whole ? of_face : some;
  const SensorNoise noise{kept.fit, kept.design};
  const double of_drift = noise.ofAll(), of_sectors = noise.ofStretches(passagesOf(face, kept.fit.dropped), of_drift);
  inflate(result, quantity::kSectorTable, of_sectors);
  inflate(result, quantity::kSensorDrift, of_drift);
  if (!(std::max(of_sectors, of_drift) > 1)) return;
  result.warnings.push_back("sector_cal: " + correlatedWarning(text(std::sqrt(of_sectors)) + " (face) and " +
                                                               text(std::sqrt(of_drift)) + " (drift)"));
}

struct Config {
  ScrewModel screw;
  std::size_t sectors{};
  double drift_limit_um_s{};
};

Outcome<Config, Refusal> readConfig(const Dataset& dataset) {
  TRY(auto screw, screwOf(dataset));
  TRY(const auto sectors, requiredPositive(dataset, "sectors"));
  if (sectors != std::floor(sectors) || sectors < static_cast<double>(kLeastSectors) ||
      sectors > static_cast<double>(kMostSectors)) {
    return Refusal{"bad-sectors", "config key 'sectors' is " + text(sectors) + ": give a whole number from " +
                                      std::to_string(kLeastSectors) + " to " + std::to_string(kMostSectors)};
  }
  TRY(const auto limit, configPositive(dataset, "drift_limit_um_s"));
  return Config{screw, static_cast<std::size_t>(sectors), limit.value_or(kDriftLimitUmS)};
}

// Nothing for a case without true errors, whose K is stated: it is about the face alone.
Outcome<std::optional<Fit>, Refusal> measuredGain(const Dataset& dataset, const ScrewModel& screw) {
  if (dataset.table("gain_cal") == nullptr) {
    TRY(const auto standing, configNumber(dataset, kStandingGain));
    if (standing) return std::optional<Fit>{};
  }
  TRY(const auto table, checkedTable(dataset, "gain_cal", kGainColumns));
  if (auto refusal = refuseOutside(screw, *table)) return *refusal;
  TRY(auto fit, fitGain(*table, screw));
  return std::optional<Fit>{std::move(fit)};
}

// Joint covariance of two sets of independent values, the first set first.
Covariance apart(const Covariance& first, const Covariance& second) {
  Covariance both = first;
  both.components.insert(both.components.end(), second.components.begin(), second.components.end());
  const std::size_t n = first.components.size();
  const std::size_t of = both.components.size();
  both.values.assign(of * of, 0.0);
  for (std::size_t i = 0; i < of; ++i) {
    for (std::size_t k = 0; k < of; ++k) {
      if (i < n && k < n) both.values[i * of + k] = first.values.at(i * n + k);
      if (i >= n && k >= n) both.values[i * of + k] = second.values.at((i - n) * (of - n) + k - n);
    }
  }
  return both;
}

// By the strokes of the nut, where they are given and by likelihood explain the true errors better than K alone.
std::optional<Refusal> addTravelGain(Result& result, const Dataset& dataset, const ScrewModel& screw, const Fit& gain) {
  TRY(const auto heat, travelOf(dataset, screw));
  if (!heat) return std::nullopt;
  const Table& table = *dataset.table("gain_cal");
  const auto* times = table.column(column::kReadAt);
  if (times == nullptr) {
    return Refusal{"missing-column", "table 'gain_cal' has no column '" + std::string{column::kReadAt.name} +
                                         "': with table 'travel' give the time of each true error, or omit that table"};
  }
  if (auto refusal = heat->validateTimes(table)) return *refusal;
  const auto& errors = *table.column(kNutError);
  const auto found = gainByTravel(screw, *heat, *times, *table.column(column::kX), *table.column(kExtension), errors,
                                  gain.sumOfSquares());
  if (!found) {
    result.warnings.emplace_back(
        "gain_cal: by likelihood the strokes of table 'travel' explain the true errors no better than K alone, and are "
        "not used");
    return std::nullopt;
  }
  const auto also = [&](std::string_view key, double value, std::optional<double> sd = std::nullopt) {
    result.also.push_back(Estimate::scalar(key, value, sd));
  };
  also(quantity::kEvenGain, found->even, found->sd_even);
  also(quantity::kTravelGain, found->travel, found->sd_travel);
  result.also.push_back(Estimate::vector(quantity::kTimeConstants,
                                         {found->law.time_constant_s.begin(), found->law.time_constant_s.end()}, {}));
  also(quantity::kTimeConstantRatio, found->law.ratio);
  also(quantity::kTravelRms, std::sqrt(found->sum_of_squares / static_cast<double>(errors.size())));
  return std::nullopt;
}

void addGain(Result& result, const Dataset& dataset, const ScrewModel& screw, const Fit& gain) {
  Answer of_gain{dataset, gain, {}};
  of_gain.readingIs("one true error of table gain_cal", "um");
  of_gain.promiseScalar(quantity::kScrewGain, gain.parameters[0], pick(0, 1, 1).row(0));
  const Result gain_result = std::move(of_gain).take(true);
  if (gain_result.covariance && result.covariance) {
    result.covariance = apart(*gain_result.covariance, *result.covariance);
  }
  result.estimates.insert(result.estimates.begin(), gain_result.estimates.front());
  result.also.push_back(Estimate::scalar("gain_rms_um", gain_result.rms, std::nullopt));
  result.also.push_back(Estimate::scalar("gain_dof", static_cast<double>(gain_result.dof), std::nullopt));
  for (const auto& warning : gain_result.warnings) result.warnings.push_back("gain_cal: " + warning);
  for (const auto& doubt : gainDoubts(*dataset.table("gain_cal"), screw, gain))
    result.warnings.push_back("gain_cal: " + doubt);
}

}  // namespace

Outcome<Result, Refusal> solveScrewCalibration(const Dataset& dataset) {
  TRY(const auto config, readConfig(dataset));
  TRY(const auto gain, measuredGain(dataset, config.screw));
  TRY(const auto face_table, checkedTable(dataset, "sector_cal", kFaceColumns));

  const Face face = faceOf(*face_table, config.sectors);
  if (auto refusal = tooLittle(face, *face_table->column(column::kPhi))) return *refusal;
  TRY(const auto of_face, fitFace(face));
  const Fit& fit = of_face.fit;

  const auto sectors = static_cast<Eigen::Index>(config.sectors);
  const double drift = fit.parameters[sectors];
  if (std::abs(drift) > config.drift_limit_um_s) {
    return Refusal{"not-steady", "the sensor drifts by " + text(drift) + " um/s, more than " +
                                     text(config.drift_limit_um_s) +
                                     ": wait until the temperature of the screw is stable"};
  }
  Answer answer{dataset, fit, {}};
  answer.readingIs(gain ? "one reading: of the sensor, for K one true error" : "one reading of the sensor", "um");
  answer.readings(*face_table, {column::kSensor}, column::kPhi);
  Eigen::MatrixXd about_mean = pick(0, sectors, fit.parameters.size());
  about_mean.leftCols(sectors).array() -= 1.0 / static_cast<double>(sectors);
  answer.promiseVector(quantity::kSectorTable, about_mean * fit.parameters, about_mean);
  answer.promiseScalar(quantity::kSensorDrift, drift, pick(sectors, 1, fit.parameters.size()).row(0));

  Result result = std::move(answer).take(true);
  widen(result, of_face, face);
  nameSpikes(result, of_face);
  if (gain) {
    addGain(result, dataset, config.screw, *gain);
    if (auto refusal = addTravelGain(result, dataset, config.screw, *gain)) return *refusal;
  }
  if (gain && dataset.config.contains(kStandingGain)) {
    result.warnings.push_back(unusedKey(kStandingGain, dataset.method));
  }
  result.convention = gain ? "K multiplies (x + orgoff) / length times the extension; rms in um"
                           : "K was not measured: the box takes that of machine.toml; rms in um";
  return result;
}

namespace {

constexpr MethodTable kCalibrationTables[]{
    {"gain_cal", kGainTableColumns,
     "true error at a position and extension, with table travel also its time; K in its place where the gain stays",
     true},
    {"sector_cal", kFaceColumns, "a sample of three or more slow turns at a steady temperature", true},
    {kTravel, kTravelColumns, "where the nut was from the cold screw on, often enough to follow its strokes; or none"}};
constexpr MethodKey kCalibrationKeys[]{
    kScrewLength,
    kScrewOffset,
    {"sectors", kNeeded, "of the face table"},
    kAxisReversed,
    {"drift_limit_um_s", "0.1", "more drift is refused"},
    {"axis", "", "axis of the screw, X, Y or Z; needed by the box"},
    MethodKey{kStandingGain, "", "gain K that is kept, instead of table gain_cal: only the face table is measured"}
        .upTo(quantity::kScrewGain.most)};
constexpr KnownQuantity kCalibrationKnown[]{kScrewLengthKnown, kScrewOffsetKnown};
constexpr Quantity kCalibrationResults[]{quantity::kScrewGain, quantity::kSectorTable, quantity::kSensorDrift};
constexpr Quantity kCalibrationFurther[]{quantity::kEvenGain, quantity::kTravelGain, quantity::kTimeConstants,
                                         quantity::kTimeConstantRatio, quantity::kTravelRms};
constexpr std::string_view kCalibrationUnobservable[]{
    kEvenHeat, "the mean height of the face separately from the zero of the sensor: the table sums to 0"};

std::optional<Subject> subjectOfScrew(const Dataset& dataset) {
  return letteredSubject(dataset, SubjectKind::screw);
}

}  // namespace

const Method kScrewCalibration{.name = "screw-calibration",
                               .title = "Calibration of a ball screw's sensor",
                               .equations = "(D1)-(D4), (D8)",
                               .source = source::kScrew,
                               .solver = solveScrewCalibration,
                               .tables = kCalibrationTables,
                               .keys = kCalibrationKeys,
                               .known = kCalibrationKnown,
                               .results = kCalibrationResults,
                               .further = kCalibrationFurther,
                               .unobservable = kCalibrationUnobservable,
                               .subject = {.of = subjectOfScrew}};

}  // namespace probebox::metrology
