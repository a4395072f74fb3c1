#include "firmware/metrology/tool/tool_assembly.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"
#include "firmware/metrology/tool/tool_readings.hpp"
#include "firmware/metrology/tool/tool_store.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr MethodColumn kVariant{"workpiece_variant", ColumnRole::number}, kRepetition{"rep", ColumnRole::number};
constexpr MethodColumn kAssemblyColumns[]{kVariant,
                                          kRepetition,
                                          {"W0_x_mm", ColumnRole::coordinate, 0, MayBe::zero},
                                          {"W0_y_mm", ColumnRole::coordinate, 0, MayBe::zero},
                                          {"L0_z_mm", ColumnRole::coordinate}};
constexpr MethodColumn kFaceColumns[]{column::number("axis"), column::number("touched"), column::number("configured")};
constexpr double kSpreadLimit = 0.2;        // mm
constexpr double kCompensationLimit = 5.0;  // mm

struct Lengths {
  double holder{};  // L1
  double tool{};    // L2
  Vector3d part = Vector3d::Zero();
  double holder_sd{};
  double tool_sd{};
  double part_sd{};
  double spread_limit{};
  double compensation_limit{};
  std::optional<double> longest;
};

std::optional<Refusal> emptyId(const Dataset& dataset) {
  for (const std::string_view key : {"holder_id", "tool_id"}) {
    const auto entry = dataset.config.find(key);
    if (entry == dataset.config.end()) continue;
    const auto* name = std::get_if<std::string>(&entry->second);
    if (name && name->empty()) {
      return Refusal{"missing-id", "config key '" + std::string{key} +
                                       "' is empty: stored lengths belong to a holder and a tool; name both"};
    }
  }
  return std::nullopt;
}

Outcome<Lengths, Refusal> lengthsOf(const Dataset& dataset, bool part_needed) {
  if (auto refusal = emptyId(dataset)) return *refusal;
  Lengths lengths;
  const auto read = [&](auto&& reader, std::string_view key, double& into, double otherwise) -> std::optional<Refusal> {
    TRY(const auto number, reader(dataset, key));
    if constexpr (requires { number.has_value(); }) {
      into = number.value_or(otherwise);
    } else {
      into = number;
    }
    return std::nullopt;
  };
  if (auto refusal = read(requiredPositive, "L1_mm", lengths.holder, 0.0)) return *refusal;
  if (auto refusal = read(requiredPositive, "L2_mm", lengths.tool, 0.0)) return *refusal;
  if (auto refusal = read(configPositive, "sd_L1_mm", lengths.holder_sd, 0.0)) return *refusal;
  if (auto refusal = read(configPositive, "sd_L2_mm", lengths.tool_sd, 0.0)) return *refusal;
  if (auto refusal = read(configPositive, "sd_part_mm", lengths.part_sd, 0.0)) return *refusal;
  if (auto refusal = read(configPositive, "spread_limit_mm", lengths.spread_limit, kSpreadLimit)) return *refusal;
  if (auto refusal = read(configPositive, "compensation_limit_mm", lengths.compensation_limit, kCompensationLimit)) {
    return *refusal;
  }
  TRY(const auto longest, configPositive(dataset, "assembled_max_mm"));
  lengths.longest = longest;
  if (!part_needed) return lengths;
  TRY(const auto part, requiredVector(dataset, "part_mm"));
  lengths.part = Vector3d{part.data()};
  return lengths;
}

// Table faces, where the case has one: a number for the face that each axis touched, and for the one it was meant for.
std::optional<Refusal> wrongFace(const Dataset& dataset) {
  if (!dataset.table("faces")) return std::nullopt;
  TRY(const auto table, checkedTable(dataset, "faces", kFaceColumns));
  const auto& axes = *table->column(kFaceColumns[0]);
  const auto& touched = *table->column(kFaceColumns[1]);
  const auto& configured = *table->column(kFaceColumns[2]);
  for (std::size_t row = 0; row < axes.size(); ++row) {
    if (axes[row] != 0.0 && axes[row] != 1.0 && axes[row] != 2.0) {
      return Refusal{"bad-face", "table 'faces', row " + std::to_string(row + 1) +
                                     ": the axis must be 0 for X, 1 for Y or 2 for Z"};
    }
    if (touched[row] == configured[row]) continue;
    return Refusal{"wrong-face", std::string{"the "} + "XYZ"[static_cast<std::size_t>(axes[row])] +
                                     " axis touched face " + text(touched[row]) + ", not face " +
                                     text(configured[row]) +
                                     " for which part_mm is stated: touch that one, or correct the configuration"};
  }
  return std::nullopt;
}

std::optional<Refusal> badAssembly(const Lengths& lengths, const Eigen::MatrixX3d& plain, double touched) {
  const Vector3d spread = plain.colwise().maxCoeff() - plain.colwise().minCoeff();
  if (spread.maxCoeff() > lengths.spread_limit) {
    return Refusal{"spread-too-large",
                   "the repetitions spread by " + text(spread.maxCoeff()) +
                       " mm: check that the tool is clamped and part_mm is right, then measure again"};
  }
  const double assembled = touched - lengths.holder;
  if (touched <= 0.0 || assembled <= 0.0) {
    return Refusal{"length-not-positive", "L0 is " + text(touched) + " mm and L3 " + text(assembled) +
                                              " mm: check the sign of Z, the relative zero and the holder's L1"};
  }
  if (lengths.longest && assembled > *lengths.longest) {
    return Refusal{"length-too-large",
                   "L3 is " + text(assembled) + " mm, more than assembled_max_mm: check the holder"};
  }
  const double compensation = touched - lengths.tool;
  if (std::abs(compensation) > lengths.compensation_limit) {
    return Refusal{"compensation-too-large", "L4 is " + text(compensation) +
                                                 " mm: another tool was measured than the stored one; measure the "
                                                 "right tool, or raise compensation_limit_mm"};
  }
  return std::nullopt;
}

}  // namespace

Outcome<Result, Refusal> solveToolAssembly(const Dataset& dataset) {
  TRY(const auto table, checkedTable(dataset, "readings", kAssemblyColumns));
  const auto& variants = *table->column(kVariant);
  TRY(const auto with_part, anySet(variants, kVariant, "bad-variant"));
  TRY(const auto side, configSense(dataset, "approach_side"));
  if (auto refusal = wrongFace(dataset)) return *refusal;
  TRY(const auto stored, withStoredLengths(dataset));
  TRY(const auto lengths, lengthsOf(stored, with_part));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));

  Eigen::MatrixX3d plain = columnsOf(*table, std::span{kAssemblyColumns}.last(3));
  plain.col(2) *= side;
  for (std::size_t row = 0; row < variants.size(); ++row) {
    plain.row(static_cast<Eigen::Index>(row)) -= variants[row] * lengths.part.transpose();
  }
  TRY(const auto fit, fitMeans(plain, std::vector<std::size_t>(variants.size(), 0), 1, sigma.value));
  const Vector3d touched = fit.parameters;
  if (auto refusal = badAssembly(lengths, plain, touched.z())) return *refusal;

  Answer answer{dataset, fit, sigma};
  answer.readings(*table, std::span{kAssemblyColumns}.last(3), kRepetition);
  answer.promiseScalar(quantity::kAssembledLength, touched.z() - lengths.holder, pick(2, 1, 3).row(0));
  answer.promiseVector(quantity::kCompensation, touched - Vector3d{0.0, 0.0, lengths.tool}, pick(0, 3, 3));
  // From the holder's reference, as [[tool]] of machine.toml counts it; L3 counts from the holder's end face.
  answer.alsoScalar(quantity::kGaugeLength, touched.z(), pick(2, 1, 3).row(0));
  const Eigen::MatrixX3d along = Eigen::Matrix3d::Identity().replicate(plain.rows(), 1);
  const auto rounding =
      roundingOfMeans(*table, {std::span{kAssemblyColumns}.last(3), scatterAlong(fit, along, sigma)}, sigma, answer);
  Result result = std::move(answer).take(true);
  double share = 0.0;  // of readings that the workpiece's size enters
  for (const double variant : variants) share += variant / static_cast<double>(variants.size());
  // Assembled length and compensation by L1, L2, the workpiece and the rounding of the readings.
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(4, 8);
  slopes(0, 0) = slopes(3, 1) = -1.0;
  slopes(0, 4) = slopes(1, 2) = slopes(2, 3) = slopes(3, 4) = -share;
  slopes(0, 7) = slopes(1, 5) = slopes(2, 6) = slopes(3, 7) = 1.0;
  Eigen::VectorXd sds = Eigen::VectorXd::Constant(8, lengths.part_sd);
  sds.head<2>() << lengths.holder_sd, lengths.tool_sd;
  sds.tail<3>() = rounding.sd_mm;
  widen(result, slopes, sds, rounding.widening);
  result.convention =
      "compensation: spindle axis minus tip, X and Y in the machine's sense, Z along the tool. Add Z to the "
      "stored length, X and Y to the commanded position. The offset of the tip from the axis has the opposite sign";
  for (auto& estimate : result.also) {
    if (estimate.key != quantity::kGaugeLength.key) continue;
    for (double& sd : estimate.sd) sd = std::hypot(rounding.widening * sd, share * lengths.part_sd, rounding.sd_mm.z());
  }
  addStoreRecords(result, dataset);
  return result;
}

namespace {

constexpr MethodTable kAssemblyTables[]{
    {"readings", kAssemblyColumns,
     "machine coordinates at contact; workpiece_variant 1 touches a workpiece, 0 the unit", true},
    {"holder_store", kHolderColumns, "optional: a holder in store"},
    {"tool_store", kToolColumns, "optional: a tool in store"},
    {"faces", kFaceColumns, "optional: number of the face that an axis (0, 1, 2) touched, and of the configured one"}};
constexpr MethodKey kAssemblyKeys[]{{"L1_mm", "", "length of the holder; needed without table holder_store"},
                                    {"L2_mm", "", "length of the tool; needed without table tool_store"},
                                    {"part_mm", "", "size of the workpiece, x y z; needed for workpiece_variant 1"},
                                    {"approach_side", "1", "-1 where the machine counts Z against the tool"},
                                    {"holder_id", "", "id of the holder in holder_store; needed with that table"},
                                    {"tool_id", "", "id of the tool in tool_store; needed with that table"},
                                    MethodKey{"measured_at_s", "", "seconds since 1970; needed with stores"}.upTo(1e10),
                                    key::kSigma,
                                    {"sd_L1_mm", "", "standard uncertainty of L1_mm (k = 1)"},
                                    {"sd_L2_mm", "", "standard uncertainty of L2_mm (k = 1)"},
                                    {"sd_part_mm", "", "standard uncertainty of part_mm (k = 1)"},
                                    {"spread_limit_mm", "0.2", "readings further apart are refused"},
                                    {"compensation_limit_mm", "5", "a larger compensation is refused"},
                                    {"assembled_max_mm", "", "a longer assembly is refused"},
                                    key::kTauForTheRecord};
constexpr KnownQuantity kAssemblyKnown[]{
    {"sd_L1_mm", "L1_mm", KnownKind::value, true, "stored length of the holder"},
    {"sd_L2_mm", "L2_mm", KnownKind::value, true, "stored length of the tool"},
    {"sd_part_mm", "part_mm", KnownKind::value, true, "position of the measuring unit"}};
constexpr Quantity kAssemblyResults[]{quantity::kAssembledLength, quantity::kCompensation};
constexpr Quantity kAssemblyFurther[]{quantity::kGaugeLength};
constexpr std::string_view kAssemblyUnobservable[]{
    "an error of L1_mm: it biases the assembled length with unit sensitivity"};

std::optional<std::string> oneEdged(const Dataset& dataset) {
  const auto part = configVector(dataset, "part_mm");
  if (!part || !part.value() || ((**part)[0] == 0.0 && (**part)[1] == 0.0)) return std::nullopt;
  return "an error of part_mm along X and Y, where one face was touched: it is in the compensation with unit "
         "sensitivity; the radius of the tool's nose, as the compensation is that of the edge that touched";
}

std::optional<Subject> subjectOfAssembly(const Dataset& dataset) {
  return numberedSubject(dataset, SubjectKind::assembly, "tool_id");
}

}  // namespace

const Method kToolAssembly{.name = "tool-assembly",
                           .title = "Length of an assembled tool",
                           .equations = "(C1)-(C4)",
                           .source = source::kTool,
                           .solver = solveToolAssembly,
                           .tables = kAssemblyTables,
                           .keys = kAssemblyKeys,
                           .known = kAssemblyKnown,
                           .results = kAssemblyResults,
                           .further = kAssemblyFurther,
                           .unobservable = kAssemblyUnobservable,
                           .undetermined = oneEdged,
                           .subject = {.of = subjectOfAssembly}};

}  // namespace probebox::metrology
