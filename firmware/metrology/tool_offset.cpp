#include "firmware/metrology/tool_offset.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/tool_store.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 5> kAssemblyColumns{"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"};
constexpr std::array<std::string_view, 3> kFaceColumns{"axis", "touched", "configured"};
constexpr std::array<std::string_view, 15> kAssemblyKeys{"approach_side",
                                                         "measured_at_s",
                                                         "L1_mm",
                                                         "L2_mm",
                                                         "part_mm",
                                                         "holder_id",
                                                         "tool_id",
                                                         "sigma_mm",
                                                         "sd_L1_mm",
                                                         "sd_L2_mm",
                                                         "sd_part_mm",
                                                         "spread_limit_mm",
                                                         "compensation_limit_mm",
                                                         "assembled_max_mm",
                                                         "previous_tau_axis_s"};
constexpr std::array<std::string_view, 4> kSetterColumns{"is_tool", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 9> kTouchColumns{"is_tool",   "nx",   "ny",   "nz",  "half_width_mm",
                                                        "radius_mm", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 7> kSetterKeys{"probe_offset_mm",    "sd_probe_offset_mm", "sigma_mm",
                                                      "accepted_setter_mm", "setter_limit_mm",    "tool",
                                                      "previous_tau_axis_s"};
constexpr double kSpreadLimit = 0.2;        // mm
constexpr double kCompensationLimit = 5.0;  // mm

Outcome<Vector3d, Refusal> requiredVector(const Dataset& dataset, std::string_view key, const std::string& what) {
  const auto vector = configVector(dataset, key);
  if (!vector) return vector.error();
  if (!vector.value()) return Refusal{"missing-key", "config.json has no key '" + std::string{key} + "': give " + what};
  return Vector3d{vector->value().data()};
}

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
                                       "' is empty: lengths in store belong to a holder and a tool; name them"};
    }
  }
  return std::nullopt;
}

Outcome<Lengths, Refusal> lengthsOf(const Dataset& dataset, bool part_needed) {
  if (auto refusal = emptyId(dataset)) return *refusal;
  Lengths lengths;
  const auto read = [&](auto&& reader, std::string_view key, double& into, double otherwise) -> std::optional<Refusal> {
    const auto number = reader(dataset, key);
    if (!number) return number.error();
    if constexpr (requires { number->has_value(); }) {
      into = number->value_or(otherwise);
    } else {
      into = number.value();
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
  const auto longest = configPositive(dataset, "assembled_max_mm");
  if (!longest) return longest.error();
  lengths.longest = longest.value();
  if (!part_needed) return lengths;
  const auto part = requiredVector(dataset, "part_mm", "the workpiece's size from the unit's reference");
  if (!part) return part.error();
  lengths.part = part.value();
  return lengths;
}

Outcome<bool, Refusal> anySet(const std::vector<double>& flags, const std::string& column, const char* name) {
  for (std::size_t row = 0; row < flags.size(); ++row) {
    if (flags[row] != 0.0 && flags[row] != 1.0) {
      return Refusal{name, "column '" + column + "', row " + std::to_string(row + 1) + ": must be 0 or 1"};
    }
  }
  return std::ranges::find(flags, 1.0) != flags.end();
}

// Table faces, where the case has one: a number for the face that each axis touched, and for the one it was meant for.
std::optional<Refusal> wrongFace(const Dataset& dataset) {
  if (!dataset.table("faces")) return std::nullopt;
  const auto table = checkedTable(dataset, "faces", kFaceColumns);
  if (!table) return table.error();
  const auto& axes = *(*table)->column("axis");
  const auto& touched = *(*table)->column("touched");
  const auto& configured = *(*table)->column("configured");
  for (std::size_t row = 0; row < axes.size(); ++row) {
    if (axes[row] != 0.0 && axes[row] != 1.0 && axes[row] != 2.0) {
      return Refusal{"bad-face", "table 'faces', row " + std::to_string(row + 1) +
                                     ": the axis must be 0 for X, 1 for Y or 2 for Z"};
    }
    if (touched[row] == configured[row]) continue;
    return Refusal{"wrong-face", std::string{"the "} + "XYZ"[static_cast<std::size_t>(axes[row])] +
                                     " axis touched face " + text(touched[row]) + ", not face " +
                                     text(configured[row]) +
                                     " that part_mm is stated for: touch that one, or correct the configuration"};
  }
  return std::nullopt;
}

std::optional<Refusal> badAssembly(const Lengths& lengths, const Eigen::MatrixX3d& plain, double touched) {
  const Vector3d spread = plain.colwise().maxCoeff() - plain.colwise().minCoeff();
  if (spread.maxCoeff() > lengths.spread_limit) {
    return Refusal{"spread-too-large", "the repetitions spread by " + text(spread.maxCoeff()) +
                                           " mm: is the tool clamped, and part_mm right? Measure again"};
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
                                                 " mm: the tool in store is not the one that was measured, or raise "
                                                 "compensation_limit_mm"};
  }
  return std::nullopt;
}

// Adds what the fit does not know of: one row a promised value, one column an input of that sd.
void widen(Result& result, const Eigen::MatrixXd& slopes, const Eigen::VectorXd& sds) {
  const Eigen::MatrixXd scaled = slopes * sds.asDiagonal();
  const Eigen::MatrixXd added = scaled * scaled.transpose();
  Eigen::Index row = 0;
  for (auto& estimate : result.estimates) {
    for (double& sd : estimate.sd) {
      sd = std::hypot(sd, std::sqrt(added(row, row)));
      ++row;
    }
  }
  if (!result.covariance) return;
  const auto entries = added.reshaped<Eigen::RowMajor>();
  for (Eigen::Index k = 0; k < added.size(); ++k) result.covariance->values[static_cast<std::size_t>(k)] += entries[k];
}

// Means of three coordinates of each of `groups` kinds of rows, with one pooled sigma.
Outcome<Fit, Refusal> fitMeans(const Eigen::MatrixX3d& positions, const std::vector<std::size_t>& group,
                               std::size_t groups, double sigma) {
  const Eigen::Index rows = 3 * positions.rows();
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(3 * groups));
  Eigen::VectorXd values{rows};
  for (Eigen::Index k = 0; k < positions.rows(); ++k) {
    const auto column = static_cast<Eigen::Index>(3 * group[static_cast<std::size_t>(k)]);
    design.block<3, 3>(3 * k, column).setIdentity();
    values.segment<3>(3 * k) = positions.row(k).transpose();
  }
  return linearLeastSquares(design / sigma, values / sigma);
}

// Whether some row of the other kind touched the face that this row touched.
bool sharesFace(const Eigen::MatrixXd& touches, Eigen::Index row) {
  for (Eigen::Index other = 0; other < touches.rows(); ++other) {
    if (touches(other, 0) == touches(row, 0)) continue;
    const bool parallel = touches.row(other).segment<3>(1).dot(touches.row(row).segment<3>(1)) > 1.0 - 1e-6;
    if (parallel && std::abs(touches(other, 4) - touches(row, 4)) < 1e-6) return true;
  }
  return false;
}

std::optional<Refusal> badTouches(const Eigen::MatrixXd& touches) {
  for (Eigen::Index row = 0; row < touches.rows(); ++row) {
    const std::string name = "table 'touches', row " + std::to_string(row + 1) + ": ";
    if (std::abs(touches.row(row).segment<3>(1).norm() - 1.0) > 1e-3) {
      return Refusal{"bad-direction", name + "the outward normal (nx,ny,nz) must have length 1"};
    }
    if (touches(row, 4) < 0.0 || touches(row, 5) < 0.0) {
      return Refusal{"bad-config", name + "half width and radius must not be negative"};
    }
    if (!sharesFace(touches, row)) {
      return Refusal{"faces-differ", name + (touches(row, 0) == 0.0 ? "the tool" : "the probe") +
                                         " did not touch this face: probe and tool must touch the same ones"};
    }
  }
  for (const double is_tool : {0.0, 1.0}) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (Eigen::Index row = 0; row < touches.rows(); ++row) {
      const Vector3d normal = touches.row(row).segment<3>(1).transpose();
      if (touches(row, 0) == is_tool) spread += normal * normal.transpose();
    }
    if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>{spread}.eigenvalues()[0] < 0.1) {
      return Refusal{"missing-face", std::string{"the faces that the "} + (is_tool == 1.0 ? "tool" : "probe") +
                                         " touched do not tell all three coordinates: touch one more"};
    }
  }
  return std::nullopt;
}

// Each touch tells one coordinate of the device's centre, along the face's normal: the half width of that face and the
// radius of what touched it are taken off.
Outcome<Fit, Refusal> fitFaces(const Eigen::MatrixXd& touches, double sigma) {
  if (auto refusal = badTouches(touches)) return *refusal;
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(touches.rows(), 6);
  Eigen::VectorXd values{touches.rows()};
  for (Eigen::Index row = 0; row < touches.rows(); ++row) {
    const Eigen::RowVector3d normal = touches.row(row).segment<3>(1).normalized();
    design.block<1, 3>(row, touches(row, 0) == 0.0 ? 0 : 3) = normal;
    values[row] = normal.dot(touches.row(row).tail<3>()) - touches(row, 4) - touches(row, 5);
  }
  return linearLeastSquares(design / sigma, values / sigma);
}

Eigen::MatrixX3d positionsOf(const Table& table, std::span<const std::string_view> columns) {
  Eigen::MatrixX3d positions{static_cast<Eigen::Index>(table.rows()), 3};
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto& column = *table.column(columns[static_cast<std::size_t>(k)]);
    positions.col(k) = Eigen::Map<const Eigen::VectorXd>{column.data(), positions.rows()};
  }
  return positions;
}

Eigen::MatrixXd touchesOf(const Table& table) {
  Eigen::MatrixXd touches{static_cast<Eigen::Index>(table.rows()), static_cast<Eigen::Index>(kTouchColumns.size())};
  for (std::size_t k = 0; k < kTouchColumns.size(); ++k) {
    touches.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::VectorXd>{table.column(kTouchColumns[k])->data(), touches.rows()};
  }
  return touches;
}

// Centres by the probe and by the tool, half widths and radii taken off before.
Outcome<Fit, Refusal> fitCentres(const Table& table, const std::vector<double>& is_tool, double sigma) {
  std::vector<std::size_t> group;
  for (const double flag : is_tool) group.push_back(flag == 0.0 ? 0 : 1);
  return fitMeans(positionsOf(table, std::span{kSetterColumns}.last(3)), group, 2, sigma);
}

}  // namespace

Outcome<Result, Refusal> solveToolAssembly(const Dataset& dataset) {
  const auto table = checkedTable(dataset, "readings", kAssemblyColumns);
  if (!table) return table.error();
  const auto& variants = *(*table)->column("workpiece_variant");
  const auto with_part = anySet(variants, "workpiece_variant", "bad-variant");
  if (!with_part) return with_part.error();
  const auto side = configSense(dataset, "approach_side");
  if (!side) return side.error();
  if (auto refusal = wrongFace(dataset)) return *refusal;
  const auto stored = withStoredLengths(dataset);
  if (!stored) return stored.error();
  const auto lengths = lengthsOf(stored.value(), with_part.value());
  if (!lengths) return lengths.error();
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();

  Eigen::MatrixX3d plain = positionsOf(**table, std::span{kAssemblyColumns}.last(3));
  plain.col(2) *= side.value();
  for (std::size_t row = 0; row < variants.size(); ++row) {
    plain.row(static_cast<Eigen::Index>(row)) -= variants[row] * lengths->part.transpose();
  }
  const auto fit = fitMeans(plain, std::vector<std::size_t>(variants.size(), 0), 1, sigma->value);
  if (!fit) return fit.error();
  const Vector3d touched = fit->parameters;
  if (auto refusal = badAssembly(lengths.value(), plain, touched.z())) return *refusal;

  Answer answer{dataset, fit.value(), sigma.value()};
  answer.readings(**table, std::span{kAssemblyColumns}.last(3), "rep");
  answer.promiseScalar("assembled_length_mm", touched.z() - lengths->holder, pick(2, 1, 3).row(0));
  answer.promiseVector("compensation_mm", touched - Vector3d{0.0, 0.0, lengths->tool}, pick(0, 3, 3));
  for (auto& warning : unusedKeys(dataset, kAssemblyKeys)) answer.warn(std::move(warning));
  Result result = std::move(answer).take(true);
  double share = 0.0;  // of readings that the workpiece's size enters
  for (const double variant : variants) share += variant / static_cast<double>(variants.size());
  // Assembled length and compensation by L1, L2 and the workpiece.
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(4, 5);
  slopes(0, 0) = slopes(3, 1) = -1.0;
  slopes(0, 4) = slopes(1, 2) = slopes(2, 3) = slopes(3, 4) = -share;
  Eigen::VectorXd sds = Eigen::VectorXd::Constant(5, lengths->part_sd);
  sds.head<2>() << lengths->holder_sd, lengths->tool_sd;
  widen(result, slopes, sds);
  result.convention =
      "Z positive along the tool, X and Y as the machine counts; add the compensation to the lengths in store";
  addStoreRecords(result, dataset);
  return result;
}

Outcome<Result, Refusal> solveToolSetter(const Dataset& dataset) {
  const auto offset = requiredVector(dataset, "probe_offset_mm", "the probe's tip from the head's reference");
  if (!offset) return offset.error();
  const auto offset_sd = configPositive(dataset, "sd_probe_offset_mm");
  if (!offset_sd) return offset_sd.error();
  const auto accepted = configVector(dataset, "accepted_setter_mm");
  if (!accepted) return accepted.error();
  const auto limit = configPositive(dataset, "setter_limit_mm");
  if (!limit) return limit.error();
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const bool by_face = dataset.table("touches") && !dataset.table("readings");
  const auto table =
      by_face ? checkedTable(dataset, "touches", kTouchColumns) : checkedTable(dataset, "readings", kSetterColumns);
  if (!table) return table.error();
  const auto& flags = *(*table)->column("is_tool");
  const auto tool = anySet(flags, "is_tool", "bad-flag");
  if (!tool) return tool.error();
  if (!tool.value())
    return Refusal{"tool-not-measured", "no row has is_tool 1: touch the setting device with the tool"};
  if (std::ranges::find(flags, 0.0) == flags.end()) {
    return Refusal{"probe-not-measured", "no row has is_tool 0: measure the setting device with the probe first"};
  }

  const auto fit = by_face ? fitFaces(touchesOf(**table), sigma->value) : fitCentres(**table, flags, sigma->value);
  if (!fit) return fit.error();
  const Vector3d setter = fit->parameters.head<3>() + *offset;
  if (accepted.value() && limit.value()) {
    const double moved = (setter - Vector3d{accepted->value().data()}).norm();
    if (moved > **limit) {
      return Refusal{"setter-moved", "the setting device lies " + text(moved) +
                                         " mm from where it was accepted: calibrate its place again"};
    }
  }
  Answer answer{dataset, fit.value(), sigma.value()};
  if (by_face) {
    answer.readings(**table, std::span{kTouchColumns}.subspan(4, 1), "is_tool");
  } else {
    answer.readings(**table, std::span{kSetterColumns}.last(3), "is_tool");
  }
  answer.promiseVector("tool_offset_mm", setter - fit->parameters.tail<3>(), pick(0, 3, 6) - pick(3, 3, 6));
  answer.promiseVector("setter_mm", setter, pick(0, 3, 6));
  for (auto& warning : unusedKeys(dataset, kSetterKeys)) answer.warn(std::move(warning));
  Result result = std::move(answer).take(true);
  widen(result, Eigen::Matrix3d::Identity().replicate(2, 1), Eigen::Vector3d::Constant(offset_sd->value_or(0.0)));
  result.convention = "tool tip from the head's reference at the B of both measurements, at the place of the device";
  return result;
}

}  // namespace probebox::metrology
