#include "firmware/metrology/screw/screw_compensation.hpp"

#include <array>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/metrology/screw/heat_by_travel.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_config.hpp"

namespace probebox::metrology {
namespace {

constexpr MethodColumn kTurns{"rpm", ColumnRole::given};
constexpr MethodColumn kCycleColumns[]{column::kSetX, column::kPhi, kTurns, column::kSensor};
constexpr MethodColumn kCycleTableColumns[]{column::kSetX, column::kPhi, kTurns, column::kSensor,
                                            column::kReadAt.orBe(MayBe::missing)};

// (D8): what the strokes of the nut add to the gain at each row of the cycle; nothing without table travel.
Outcome<std::optional<std::vector<double>>, Refusal> travelPart(const Dataset& dataset, const ScrewModel& screw,
                                                                const Table& cycle) {
  TRY(const auto heat, travelOf(dataset, screw));
  if (!heat && dataset.config.contains(quantity::kTravelGain.key)) {
    return Refusal{"missing-table", "key '" + std::string{quantity::kTravelGain.key} + "' needs table '" + kTravel +
                                        "': say where the nut was, or give K of screw-calibration alone"};
  }
  if (!heat) return std::optional<std::vector<double>>{};
  TRY(const auto gain, requiredNumber(dataset, quantity::kTravelGain.key));
  TRY(const auto constants, configPlane(dataset, quantity::kTimeConstants.key));
  TRY(const auto ratio, configNumber(dataset, quantity::kTimeConstantRatio.key));
  const auto* times = cycle.column(column::kReadAt);
  if (times != nullptr) {
    if (auto refusal = heat->validateTimes(cycle)) return *refusal;
  }
  if (!constants || !((*constants)[0] > 0 && (*constants)[1] > 0) || times == nullptr) {
    return Refusal{"missing-key", "table 'travel' needs " + std::string{quantity::kTimeConstants.key} +
                                      ", both above zero, as screw-calibration found them, and column '" +
                                      std::string{column::kReadAt.name} + "' of table 'cycle'"};
  }
  auto part = heat->sharesOf({*constants, ratio.value_or(0)}, *times, *cycle.column(column::kX));
  for (double& share : part) share *= gain;
  return std::optional{std::move(part)};
}

Outcome<ScrewModel, Refusal> readScrew(const Dataset& dataset) {
  TRY(auto screw, screwOf(dataset));
  TRY(const auto gain, requiredNumber(dataset, "K"));
  TRY(const auto threshold, requiredNumber(dataset, "threshold_rpm"));
  if (threshold < 0.0) return Refusal{"bad-config", "config key 'threshold_rpm' must not be negative"};
  TRY(const auto reference, configNumber(dataset, "reference_um"));
  TRY(const auto table, checkedTable(dataset, "sector_table", kSectorColumns));
  screw.gain = gain;
  screw.threshold_rpm = threshold;
  screw.reference_um = reference.value_or(0.0);
  if (auto refusal = fillSectors(screw, *table, 0.0)) return *refusal;
  return screw;
}

std::optional<Refusal> outOfLimits(const Dataset& dataset, const ScrewModel& screw, const std::vector<double>& sensor) {
  TRY(const auto least, configNumber(dataset, "extension_min_um"));
  TRY(const auto greatest, configNumber(dataset, "extension_max_um"));
  for (std::size_t row = 0; row < sensor.size(); ++row) {
    const double extension = sensor[row] - screw.reference_um;
    if (extension < least.value_or(extension) || extension > greatest.value_or(extension)) {
      return Refusal{"extension-out-of-limits", "table 'cycle', row " + std::to_string(row + 1) +
                                                    ": the extension is " + text(extension) +
                                                    " um, outside extension_min_um to extension_max_um: check the "
                                                    "sensor"};
    }
  }
  return std::nullopt;
}

}  // namespace

Outcome<Result, Refusal> solveScrewCompensation(const Dataset& dataset) {
  TRY(const auto screw, readScrew(dataset));
  TRY(const auto sigma, configSigma(dataset, "sigma_um"));
  TRY(const auto table, checkedTable(dataset, "cycle", kCycleColumns));
  if (auto refusal = refuseOutside(screw, *table)) return *refusal;
  const auto& positions = *table->column(column::kX);
  const auto& angles = *table->column(column::kPhi);
  const auto& speeds = *table->column(kTurns);
  const auto& sensor = *table->column(column::kSensor);
  if (auto refusal = outOfLimits(dataset, screw, sensor)) return *refusal;

  TRY(const auto by_travel, travelPart(dataset, screw, *table));

  Result result;
  result.method = dataset.method;
  std::vector<double> compensation;
  std::vector<double> sd;
  std::vector<double> design;
  for (std::size_t row = 0; row < positions.size(); ++row) {
    const double extension = extensionUm(screw, angles[row], speeds[row], sensor[row]);
    const double per_um = compensationUm(screw, positions[row], 1.0) + (by_travel ? (*by_travel)[row] : 0.0);
    compensation.push_back(per_um * extension);
    design.push_back(std::abs(per_um));
    if (sigma.stated) sd.push_back(std::abs(per_um * sigma.value));
  }
  result.estimates.push_back(Estimate::vector(quantity::kScrewCorrections, std::move(compensation), std::move(sd)));
  result.estimates.back().design = std::move(design);
  result.design_per = "one reading of the sensor, um";
  result.condition = 1.0;
  if (!sigma.stated) result.warnings.emplace_back("no sd: no sigma_um of the sensor is stated, and nothing is fitted");
  result.convention = "added to the commanded position when K carries the sign of the correction; um";
  return result;
}

namespace {

constexpr MethodTable kCompensationTables[]{
    {"cycle", kCycleTableColumns, "position, angle and speed of the screw, and its sensor"},
    {"sector_table", kSectorColumns, "a sector of the calibrated face table"},
    {kTravel, kTravelColumns, "where the nut was from the cold screw on, for travel_gain; or none"}};
constexpr MethodKey kCompensationKeys[]{
    kScrewLength,
    kScrewOffset,
    MethodKey{"K", kNeeded, "calibrated gain"}.upTo(quantity::kScrewGain.most),
    {"threshold_rpm", kNeeded, "at this speed and above the face table is not subtracted (D5)"},
    kAxisReversed,
    {"reference_um", "0", "the sensor's reading of the cold screw"},
    {"extension_min_um", "", "a smaller extension is refused"},
    {"extension_max_um", "", "a larger extension is refused"},
    {"sigma_um", "", "standard deviation of one reading of the sensor (k = 1)"},
    MethodKey{quantity::kTravelGain.key, "", "with table travel: the part of the gain by strokes; K is then even_gain"}
        .upTo(quantity::kTravelGain.most),
    MethodKey{quantity::kTimeConstants.key, "", "with table travel: fast and slow cooling of a segment"}.within(
        1, quantity::kTimeConstants.most),
    {quantity::kTimeConstantRatio.key, "0", "with table travel: slow part of the heat over the fast one"}};
constexpr KnownQuantity kCompensationKnown[]{
    kScrewLengthKnown,
    kScrewOffsetKnown,
    {"sd_K", "K", KnownKind::value, false, "gain of the screw"},
    {"sd_travel_gain", quantity::kTravelGain.key, KnownKind::value, false, "gain of the screw by strokes"},
    {"sd_reference_um", "reference_um", KnownKind::value, false, "reading of the cold screw"}};
constexpr Quantity kCompensationResults[]{quantity::kScrewCorrections};
constexpr std::string_view kCompensationUnobservable[]{kEvenHeat};

}  // namespace

const Method kScrewCompensation{.name = "screw-compensation",
                                .title = "Compensation of a ball screw",
                                .equations = "(D1), (D3), (D5), (D8)",
                                .source = source::kScrew,
                                .solver = solveScrewCompensation,
                                .tables = kCompensationTables,
                                .keys = kCompensationKeys,
                                .known = kCompensationKnown,
                                .results = kCompensationResults,
                                .unobservable = kCompensationUnobservable};

}  // namespace probebox::metrology
