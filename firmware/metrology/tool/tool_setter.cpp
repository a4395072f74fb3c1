#include "firmware/metrology/tool/tool_setter.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"
#include "firmware/metrology/tool/tool_readings.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

// The turning axis: c(Z) = at + tilt (Z - z).
struct TurningAxis {
  Eigen::Vector2d at;
  double z{};
  Eigen::Vector2d tilt{0.0, 0.0};
  double sd{};
  double tilt_sd{};

  Eigen::Vector2d here(double height) const { return at + tilt * (height - z); }
};

using Eigen::Vector2d;

// Of a tool setter's case: centreline_mm, C_tilt_rad, centreline_z_mm and their sd; nothing where it states none.
// Refuses: missing-key (one that needs another), bad-config.
Outcome<std::optional<TurningAxis>, Refusal> turningAxis(const Dataset& dataset) {
  TRY(const auto at, configPlane(dataset, "centreline_mm"));
  TRY(const auto tilt, configPlane(dataset, "C_tilt_rad"));
  TRY(const auto z, configNumber(dataset, "centreline_z_mm"));
  TRY(const auto sd, configPositive(dataset, "sd_centreline_mm"));
  TRY(const auto tilt_sd, configPositive(dataset, "sd_C_tilt_rad"));
  for (const std::string_view key : {"C_tilt_rad", "sd_centreline_mm", "accepted_link_mm"}) {
    if (dataset.config.contains(key) && !at) {
      return Refusal{"missing-key", "config key '" + std::string{key} +
                                        "' is stated without centreline_mm: give x and y "
                                        "of the turning axis"};
    }
  }
  if (tilt.has_value() != z.has_value() || (tilt_sd && !tilt)) {
    return Refusal{"missing-key",
                   "C_tilt_rad and centreline_z_mm belong together: the tilt of the turning axis, and the Z at which "
                   "it is at centreline_mm"};
  }
  if (!at) return std::optional<TurningAxis>{};
  TurningAxis axis{.at = Vector2d{at->data()}};
  if (tilt) axis.tilt = Vector2d{tilt->data()};
  axis.z = z.value_or(0.0);
  axis.sd = sd.value_or(0.0);
  axis.tilt_sd = tilt_sd.value_or(0.0);
  return std::optional{axis};
}

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr MethodColumn kIsTool{"is_tool", ColumnRole::number}, kHalfWidth{"half_width_mm", ColumnRole::given};
constexpr MethodColumn kBOfSeveral = column::kB.orBe(MayBe::missing);
constexpr MethodColumn kCentreColumns[]{kIsTool, column::kX, column::kY, column::kZ, kBOfSeveral};
constexpr MethodColumn kTouchColumns[]{
    kIsTool,    column::kNormalX, column::kNormalY, column::kNormalZ, kHalfWidth, column::given("radius_mm"),
    column::kX, column::kY,       column::kZ,       kBOfSeveral};
constexpr MethodColumn kOffsetColumns[]{column::kB, column::kSetX, column::kSetY, column::kSetZ};
constexpr std::size_t kMostAngles = 20;  // more do not fit into one covariance

// The readings, and at which B each was made.
struct Device {
  const Table* table{};
  bool by_face{};
  bool without_y{};                // of a lathe of X and Z
  std::vector<double> angles_deg;  // rising; empty where the case has no B
  std::vector<std::size_t> angle;  // of each row

  std::size_t angles() const { return std::max<std::size_t>(angles_deg.size(), 1); }
  // " at B = 90", for sentences.
  std::string at(std::size_t k) const {
    return angles_deg.empty() ? "" : " at B = " + text(angles_deg[k]) + " degrees";
  }
};

// As measured: angles of one stop are one.
std::size_t angleAt(const std::vector<double>& angles_deg, double angle_deg) {
  const auto near = [&](double other) { return std::abs(other - angle_deg) <= kSameStop_deg; };
  return static_cast<std::size_t>(std::ranges::find_if(angles_deg, near) - angles_deg.begin());
}

Outcome<Device, Refusal> readDevice(const Dataset& dataset) {
  Device device;
  TRY(const auto axes, configWord(dataset, key::kMachineAxes.name, key::kAxesOfMachines));
  device.without_y = axes == key::kAxesOfMachines[1];
  device.by_face = dataset.table("touches") && !dataset.table("readings");
  const std::string_view name = device.by_face ? "touches" : "readings";
  std::span<const MethodColumn> columns{kCentreColumns};
  if (device.by_face) columns = kTouchColumns;
  const Table* offered = dataset.table(name);
  const bool swivels = offered && offered->column(column::kB);
  TRY(const auto table, checkedTable(dataset, name, swivels ? columns : columns.first(columns.size() - 1)));
  device.table = table;
  device.angle.resize(device.table->rows());
  if (!swivels) return device;
  const auto& b = *device.table->column(column::kB);
  for (const double angle : b) {
    if (angleAt(device.angles_deg, angle) == device.angles_deg.size()) device.angles_deg.push_back(angle);
  }
  if (device.angles_deg.size() > kMostAngles) {
    return Refusal{"too-many-angles", "the device was measured at " + std::to_string(device.angles_deg.size()) +
                                          " angles of B, " + std::to_string(kMostAngles) +
                                          " fit into a case: split it into two"};
  }
  std::ranges::sort(device.angles_deg);
  for (std::size_t row = 0; row < b.size(); ++row) device.angle[row] = angleAt(device.angles_deg, b[row]);
  return device;
}

std::optional<Refusal> notMeasured(const Device& device) {
  const auto& flags = *device.table->column(kIsTool);
  TRY(anySet(flags, kIsTool, "bad-flag"));
  for (std::size_t k = 0; k < device.angles(); ++k) {
    std::array<bool, 2> measured{};
    for (std::size_t row = 0; row < flags.size(); ++row) {
      if (device.angle[row] == k) measured[flags[row] == 1.0 ? 1 : 0] = true;
    }
    if (!measured[1]) {
      return Refusal{"tool-not-measured",
                     "no row has is_tool 1" + device.at(k) + ": touch the setting device with the tool"};
    }
    if (!measured[0]) {
      return Refusal{"probe-not-measured",
                     "no row has is_tool 0" + device.at(k) + ": measure the setting device with the probe first"};
    }
  }
  return std::nullopt;
}

// Tip of the probe from the head's reference, a row each B.
Outcome<MatrixX3d, Refusal> probeOffsets(const Dataset& dataset, const Device& device) {
  if (device.angles_deg.empty()) {
    TRY(const auto offset, requiredVector(dataset, "probe_offset_mm"));
    return MatrixX3d{Eigen::RowVector3d{offset.data()}};
  }
  if (dataset.config.contains("probe_offset_mm")) {
    return Refusal{"bad-config",
                   "the readings have a column B_deg: give the probe's offset at each B in table 'probe_offsets', and "
                   "not as probe_offset_mm"};
  }
  TRY(const auto table, checkedTable(dataset, "probe_offsets", kOffsetColumns));
  const auto& b = *table->column(column::kB);
  for (std::size_t row = 0; row < b.size(); ++row) {
    if (angleAt(b, b[row]) == row) continue;
    return Refusal{"duplicated-angle", "table 'probe_offsets' has B = " + text(b[row]) + " degrees twice: remove one"};
  }
  const MatrixXd offered = columnsOf(*table, std::span{kOffsetColumns}.last(3));
  MatrixX3d offsets{static_cast<Index>(device.angles()), 3};
  for (std::size_t k = 0; k < device.angles(); ++k) {
    const std::size_t row = angleAt(b, device.angles_deg[k]);
    if (row == b.size()) {
      return Refusal{"missing-orientation",
                     "table 'probe_offsets' has no row" + device.at(k) + ": the probe's tip there is needed"};
    }
    offsets.row(static_cast<Index>(k)) = offered.row(static_cast<Index>(row));
  }
  return offsets;
}

// Touches of a lathe of X and Z, as the case says: none along Y, which then counts as 0. Several B would turn them out
// of that plane.
bool isFlat(const Device& device) {
  return device.without_y && device.by_face && device.angles() == 1 &&
         std::ranges::all_of(*device.table->column(column::kNormalY), [](double along) { return along == 0.0; });
}

// Whether some row of the other kind touched the face that this row touched, at the same B.
bool sharesFace(const MatrixXd& touches, const Device& device, Index row) {
  for (Index other = 0; other < touches.rows(); ++other) {
    const bool same_angle =
        device.angle[static_cast<std::size_t>(other)] == device.angle[static_cast<std::size_t>(row)];
    if (!same_angle || touches(other, 0) == touches(row, 0)) continue;
    const Vector3d mine = touches.row(row).segment<3>(1).transpose().normalized();
    const Vector3d theirs = touches.row(other).segment<3>(1).transpose().normalized();
    // Written with three digits and with more, one normal differs by less than a milliradian.
    const bool parallel = mine.dot(theirs) > 1.0 - 1e-6;
    if (parallel && std::abs(touches(other, 4) - touches(row, 4)) < 1e-6) return true;
  }
  return false;
}

std::optional<Refusal> badTouches(const MatrixXd& touches, const Device& device) {
  for (Index row = 0; row < touches.rows(); ++row) {
    const std::string name = "table 'touches', row " + std::to_string(row + 1) + ": ";
    if (std::abs(touches.row(row).segment<3>(1).norm() - 1.0) > 1e-3) {
      return Refusal{"bad-direction", name + "the outward normal (nx,ny,nz) must have length 1"};
    }
    if (touches(row, 4) < 0.0 || touches(row, 5) < 0.0) {
      return Refusal{"bad-config", name + "half width and radius must not be negative"};
    }
    if (!sharesFace(touches, device, row)) {
      return Refusal{"faces-differ", name + (touches(row, 0) == 0.0 ? "the tool" : "the probe") +
                                         " did not touch this face: probe and tool must touch the same ones"};
    }
  }
  for (std::size_t group = 0; group < 2 * device.angles(); ++group) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    if (isFlat(device)) spread(1, 1) = 1.0;
    for (Index row = 0; row < touches.rows(); ++row) {
      const Vector3d normal = touches.row(row).segment<3>(1).transpose();
      const auto angle = device.angle[static_cast<std::size_t>(row)];
      if (2 * angle + (touches(row, 0) == 1.0 ? 1 : 0) == group) spread += normal * normal.transpose();
    }
    if (symmetricEigenvalues(spread)[0] < 0.1) {
      return Refusal{"missing-face", std::string{"the faces that the "} + (group % 2 == 1 ? "tool" : "probe") +
                                         " touched" + device.at(group / 2) +
                                         " do not determine all coordinates: touch one more"};
    }
  }
  return std::nullopt;
}

// What rounding changes: a place that was read repeatedly, which is a centre's coordinate or a face.
struct RoundedPlaces {
  MatrixXd parameters;  // of the fit by the rounding of each place, a column a place
  MatrixX3d along;      // direction in which each was read, a unit vector a row
};

struct Measured {
  Fit fit;
  MatrixX3d along;  // of each residual
  RoundedPlaces places;
};

// The sum of the rows of `design` that touched one face, a column each face of each group, and the faces' normals.
RoundedPlaces sumsOfFaces(const MatrixXd& touches, const std::vector<std::size_t>& group, const MatrixXd& design) {
  using Face = std::pair<std::size_t, std::array<double, 5>>;
  std::map<Face, VectorXd> sums;
  for (Index row = 0; row < touches.rows(); ++row) {
    Face face{group[static_cast<std::size_t>(row)], {}};
    Eigen::Map<Eigen::RowVectorXd>{face.second.data(), 5} = touches.row(row).segment<5>(1);
    auto& sum = sums.try_emplace(face, VectorXd::Zero(design.cols())).first->second;
    sum += design.row(row).transpose();
  }
  RoundedPlaces faces{MatrixXd{design.cols(), static_cast<Index>(sums.size())},
                      MatrixX3d{static_cast<Index>(sums.size()), 3}};
  for (Index place = 0; const auto& [face, sum] : sums) {
    faces.parameters.col(place) = sum;
    faces.along.row(place++) = Vector3d{face.second.data()}.normalized().transpose();
  }
  return faces;
}

// Fits without the columns of Y, which are empty, and gives those parameters as 0 and known.
Outcome<Fit, Refusal> fitWithoutY(const MatrixXd& design, const VectorXd& values) {
  std::vector<Index> kept;
  for (Index column = 0; column < design.cols(); ++column) {
    if (column % 3 != 1) kept.push_back(column);
  }
  TRY(const auto reduced, linearLeastSquares(design(Eigen::all, kept), values));
  Fit whole = reduced;
  whole.parameters = VectorXd::Zero(design.cols());
  whole.cofactor = MatrixXd::Zero(design.cols(), design.cols());
  whole.parameters(kept) = reduced.parameters;
  whole.cofactor(kept, kept) = reduced.cofactor;
  return whole;
}

// The device's centre as the probe sees it, then as the tool does, at one B after the other: three numbers each.
// Each touch tells one coordinate of it, along the face's normal: the half width of that face and the radius of what
// touched it are taken off.
Outcome<Measured, Refusal> fitFaces(const Device& device, const std::vector<std::size_t>& group, double sigma,
                                    double stylus_mm) {
  const MatrixXd touches = columnsOf(*device.table, std::span{kTouchColumns}.first(9));
  if (auto refusal = badTouches(touches, device)) return *refusal;
  MatrixXd design = MatrixXd::Zero(touches.rows(), static_cast<Index>(6 * device.angles()));
  VectorXd values{touches.rows()};
  for (Index row = 0; row < touches.rows(); ++row) {
    const Eigen::RowVector3d normal = touches.row(row).segment<3>(1).normalized();
    design.block<1, 3>(row, static_cast<Index>(3 * group[static_cast<std::size_t>(row)])) = normal;
    const double radius_mm = touches(row, 5) + (touches(row, 0) == 0.0 ? stylus_mm : 0.0);
    values[row] = normal.dot(touches.row(row).tail<3>()) - touches(row, 4) - radius_mm;
  }
  TRY(auto fit, isFlat(device) ? fitWithoutY(design / sigma, values / sigma)
                               : linearLeastSquares(design / sigma, values / sigma));
  RoundedPlaces places = sumsOfFaces(touches, group, design);
  places.parameters = fit.cofactor / (sigma * sigma) * places.parameters;
  return Measured{std::move(fit), touches.middleCols<3>(1).rowwise().normalized(), std::move(places)};
}

Outcome<Measured, Refusal> fitDevice(const Device& device, double sigma, double stylus_mm) {
  const auto& flags = *device.table->column(kIsTool);
  std::vector<std::size_t> group;
  for (std::size_t row = 0; row < flags.size(); ++row) {
    group.push_back(2 * device.angle[row] + (flags[row] == 1.0 ? 1 : 0));
  }
  if (device.by_face) return fitFaces(device, group, sigma, stylus_mm);
  MatrixXd centres = columnsOf(*device.table, std::span{kCentreColumns}.subspan(1, 3));
  for (std::size_t row = 0; row < flags.size(); ++row) {
    if (flags[row] == 0.0) centres(static_cast<Index>(row), 2) -= stylus_mm;
  }
  TRY(auto fit, fitMeans(centres, group, 2 * device.angles(), sigma));
  const Index parameters = fit.parameters.size();
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  return Measured{std::move(fit),
                  axes.replicate(centres.rows(), 1),
                  {MatrixXd::Identity(parameters, parameters), axes.replicate(parameters / 3, 1)}};
}

// A row each B, by the parameters of the fit and by what the fit does not know of: the probe's offsets, three each B,
// then place (2) and tilt (2) of the turning axis.
struct ByOrientation {
  MatrixXd values;
  MatrixXd by_readings;
  MatrixXd by_inputs;

  ByOrientation(const Device& device, Index columns)
      : values{static_cast<Index>(device.angles()), columns},
        by_readings{MatrixXd::Zero(values.size(), 6 * values.rows())},
        by_inputs{MatrixXd::Zero(values.size(), 3 * values.rows() + 4)} {}
};

struct Found {
  ByOrientation tool;
  ByOrientation setter;
  std::optional<ByOrientation> link;
};

// (B22), (B22b)
Found found(const Device& device, const MatrixX3d& offsets, const std::optional<TurningAxis>& axis, const Fit& fit) {
  Found found{ByOrientation{device, 3}, ByOrientation{device, 3}, std::nullopt};
  if (axis) found.link = ByOrientation{device, 2};
  for (Index k = 0; k < offsets.rows(); ++k) {
    const Vector3d setter = fit.parameters.segment<3>(6 * k) + offsets.row(k).transpose();
    found.setter.values.row(k) = setter.transpose();
    found.tool.values.row(k) = (setter - fit.parameters.segment<3>(6 * k + 3)).transpose();
    found.tool.by_readings.block<3, 3>(3 * k, 6 * k + 3) = -Eigen::Matrix3d::Identity();
    for (ByOrientation* each : {&found.tool, &found.setter}) {
      each->by_readings.block<3, 3>(3 * k, 6 * k).setIdentity();
      each->by_inputs.block<3, 3>(3 * k, 3 * k).setIdentity();
    }
    if (!axis) continue;
    ByOrientation& link = *found.link;
    link.values.row(k) = (setter.head<2>() - axis->here(setter.z())).transpose();
    Eigen::Matrix<double, 2, 3> by_setter = Eigen::Matrix<double, 2, 3>::Identity();
    by_setter.col(2) = -axis->tilt;
    link.by_readings.block<2, 3>(2 * k, 6 * k) = by_setter;
    link.by_inputs.block<2, 3>(2 * k, 3 * k) = by_setter;
    link.by_inputs.rightCols<4>().middleRows<2>(2 * k).leftCols<2>() = -Eigen::Matrix2d::Identity();
    link.by_inputs.rightCols<2>().middleRows<2>(2 * k) = -(setter.z() - axis->z) * Eigen::Matrix2d::Identity();
  }
  return found;
}

// Values that were accepted before, a row each B. Nothing without the key.
Outcome<std::optional<MatrixXd>, Refusal> accepted(const Dataset& dataset, std::string_view key, std::size_t angles,
                                                   std::size_t columns) {
  TRY(const auto rows, configMatrix(dataset, key, angles, columns));
  if (!rows) return std::optional<MatrixXd>{};
  MatrixXd places{static_cast<Index>(angles), static_cast<Index>(columns)};
  for (Index k = 0; k < places.rows(); ++k) {
    places.row(k) = Eigen::RowVectorXd::Map((*rows)[static_cast<std::size_t>(k)].data(), places.cols());
  }
  return std::optional{places};
}

// Of two places, or of two links, in x and y and for places z; without Y where nothing told it.
double apart(Eigen::RowVectorXd now, const Eigen::RowVectorXd& then, bool flat) {
  now -= then;
  if (flat) now[1] = 0;
  return now.norm();
}

std::optional<Refusal> moved(const Dataset& dataset, const Device& device, const Found& found) {
  TRY(const auto limit, configPositive(dataset, "setter_limit_mm"));
  // Three numbers alone are the place at the first B.
  const auto entry = dataset.config.find("accepted_setter_mm");
  const bool of_first = entry != dataset.config.end() && std::holds_alternative<std::vector<double>>(entry->second);
  TRY(const auto setter, accepted(dataset, "accepted_setter_mm", of_first ? 1 : device.angles(), 3));
  TRY(const auto link, accepted(dataset, "accepted_link_mm", device.angles(), 2));
  if (link && !limit) {
    return Refusal{"missing-key", "accepted_link_mm needs setter_limit_mm, the largest change that is accepted"};
  }
  if (!limit) return std::nullopt;
  const auto compare = [&](const MatrixXd& now, const MatrixXd& then, const std::string& from) {
    std::optional<Refusal> refusal;
    for (Index k = 0; k < then.rows() && !refusal; ++k) {
      const double off = apart(now.row(k), then.row(k), isFlat(device));
      if (off <= *limit) continue;
      refusal =
          Refusal{"setter-moved", "the setting device" + device.at(static_cast<std::size_t>(k)) + " lies " + text(off) +
                                      " mm from where it was accepted" + from + ": calibrate its position again"};
    }
    return refusal;
  };
  if (setter) {
    if (auto refusal = compare(found.setter.values, *setter, "")) return refusal;
  }
  if (!link) return std::nullopt;
  return compare(found.link->values, *link, ", seen from the turning axis");
}

void promise(Answer& answer, const Device& device, std::string_view key, const ByOrientation& quantity) {
  const VectorXd values = quantity.values.reshaped<Eigen::RowMajor>();
  if (device.angles_deg.empty()) {
    answer.promiseVector(key, values, quantity.by_readings);
  } else {
    answer.promiseMatrix(key, static_cast<std::size_t>(quantity.values.cols()), values, quantity.by_readings);
  }
}

// The coordinates that are told, each under its key: x and z of tool and device, x of the link.
struct Coordinate {
  const Quantity* quantity{};
  const ByOrientation* of{};
  Index row{};
};

std::vector<Coordinate> coordinatesOf(const Found& found) {
  std::vector<Coordinate> all{{&quantity::kToolOffsetX, &found.tool, 0},
                              {&quantity::kToolOffsetZ, &found.tool, 2},
                              {&quantity::kSetterX, &found.setter, 0},
                              {&quantity::kSetterZ, &found.setter, 2}};
  if (found.link) all.push_back({&quantity::kLinkX, &*found.link, 0});
  return all;
}

void promiseFlat(Answer& answer, const Found& found) {
  for (const auto& [quantity, of, row] : coordinatesOf(found))
    answer.promiseScalar(quantity->key, of->values(0, row), of->by_readings.row(row));
}

// The promised values by what the fit does not know of: offsets and turning axis, then the rounding of the readings.
MatrixXd slopesOf(const Found& found, const MatrixXd& by_rounding, bool flat) {
  if (flat) {
    const auto all = coordinatesOf(found);
    MatrixXd slopes{static_cast<Index>(all.size()), found.tool.by_inputs.cols() + by_rounding.cols()};
    for (Index i = 0; const auto& [quantity, of, row] : all)
      slopes.row(i++) << of->by_inputs.row(row), of->by_readings.row(row) * by_rounding;
    return slopes;
  }
  std::vector<const ByOrientation*> quantities{&found.tool, &found.setter};
  if (found.link) quantities.push_back(&*found.link);
  MatrixXd slopes{0, found.tool.by_inputs.cols() + by_rounding.cols()};
  for (const auto* quantity : quantities) {
    slopes.conservativeResize(slopes.rows() + quantity->by_inputs.rows(), Eigen::NoChange);
    slopes.bottomRows(quantity->by_inputs.rows()) << quantity->by_inputs, quantity->by_readings * by_rounding;
  }
  return slopes;
}

Result report(const Device& device, const Found& found, const std::optional<TurningAxis>& axis, double offset_sd,
              const Measured& measured, const Sigma& sigma, Answer answer) {
  const auto parts = device.by_face ? std::span{kTouchColumns}.subspan(4, 1) : std::span{kCentreColumns}.subspan(1, 3);
  answer.readings(*device.table, parts, kIsTool);
  const bool flat = isFlat(device);
  if (flat) {
    promiseFlat(answer, found);
  } else {
    promise(answer, device, quantity::kToolOffset, found.tool);
    promise(answer, device, quantity::kSetter, found.setter);
    if (found.link) promise(answer, device, quantity::kLink, *found.link);
  }
  const auto rounding = roundingOfMeans(
      *device.table, {std::span{kTouchColumns}.subspan(6, 3), scatterAlong(measured.fit, measured.along, sigma)}, sigma,
      answer);
  Result result = std::move(answer).take(true);
  result.convention = "tool tip from the head's reference at the B of both measurements, at the place of the device";
  if (axis) result.convention += "; link: the device from the turning axis, in x and y, at the device's Z";
  if (!device.angles_deg.empty()) result.also.push_back(Estimate::vector(quantity::kEachB, device.angles_deg, {}));

  const Index inputs = found.tool.by_inputs.cols();
  const RoundedPlaces& places = measured.places;
  VectorXd sds = VectorXd::Constant(inputs + places.along.rows(), offset_sd);
  sds.segment<4>(inputs - 4) << Vector2d::Constant(axis ? axis->sd : 0.0),
      Vector2d::Constant(axis ? axis->tilt_sd : 0.0);
  sds.tail(places.along.rows()) = (places.along.cwiseAbs2() * rounding.sd_mm.cwiseAbs2()).cwiseSqrt();
  widen(result, slopesOf(found, places.parameters, flat), sds, rounding.widening);
  return result;
}

}  // namespace

Outcome<Result, Refusal> solveToolSetter(const Dataset& dataset) {
  TRY(const auto device, readDevice(dataset));
  TRY(const auto offsets, probeOffsets(dataset, device));
  TRY(const auto offset_sd, configPositive(dataset, "sd_probe_offset_mm"));
  TRY(const auto axis, turningAxis(dataset));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto stylus, configPositive(dataset, "stylus_ball_radius_mm"));
  if (auto refusal = notMeasured(device)) return *refusal;
  TRY(const auto measured, fitDevice(device, sigma.value, stylus.value_or(0.0)));
  const Found answer = found(device, offsets, axis, measured.fit);
  if (auto refusal = moved(dataset, device, answer)) return *refusal;
  return report(device, answer, axis, offset_sd.value_or(0.0), measured, sigma, Answer{dataset, measured.fit, sigma});
}

namespace {

constexpr MethodTable kSetterTables[]{
    {"readings", kCentreColumns,
     "machine position at the device's centre, of the probe above it by stylus_ball_radius_mm; B_deg too for several B",
     true},
    {"touches", kTouchColumns, "instead of readings: machine position at contact with a face; B_deg too for several B"},
    {"probe_offsets", kOffsetColumns,
     "for several B, instead of key probe_offset_mm: the probe's tip from the head's reference"}};
constexpr MethodKey kCentrelineResult{"centreline_result", "", "number of the centreline's result; for the record",
                                      SubjectKind::centreline};
constexpr MethodKey kStylusOffsetResult{"stylus_offset_result", "",
                                        "number of the result that X and Y of probe_offset_mm are of; for the record",
                                        SubjectKind::stylus_offset};
constexpr MethodKey kSetterKeys[]{
    {"probe_offset_mm", "",
     "the probe's tip from the head's reference, x y z; needed unless table probe_offsets is given"},
    {"sd_probe_offset_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    key::kSigma,
    MethodKey{"stylus_ball_radius_mm", "0",
              "radius of the probe's stylus ball, added to radius_mm of its touches, or taken off z_mm of its readings"}
        .within(key::kStylusRadius.least, key::kStylusRadius.most),
    {"sd_half_width_mm", "", "standard uncertainty of column half_width_mm (k = 1)"},
    key::kMachineAxes,
    {"accepted_setter_mm", "",
     "accepted position of the device, x y z; for several B one row per B, or one row for the first B"},
    {"setter_limit_mm", "", "largest distance of the device from its accepted position that is allowed"},
    {"centreline_mm", "", "x and y of the turning axis at centreline_z_mm; gives link_mm"},
    {"centreline_z_mm", "0", "Z of centreline_mm"},
    MethodKey{"C_tilt_rad", "[0,0]", "tilt of the turning axis, x y per mm of Z"}.upTo(quantity::kMostLean_rad),
    {"sd_centreline_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    {"sd_C_tilt_rad", "", "standard uncertainty of its components (k = 1)"},
    {"accepted_link_mm", "", "accepted link_mm, x y; one row per B"},
    {"tool", "", "number of the tool whose offset it is"},
    kCentrelineResult,
    kStylusOffsetResult,
    key::kTauForTheRecord};
constexpr KnownQuantity kSetterKnown[]{
    {"sd_probe_offset_mm", "probe_offset_mm", KnownKind::value, true, "offset of the probe"},
    {"sd_probe_offset_mm", "probe_offsets", KnownKind::table, true},
    {"sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"sd_half_width_mm", kHalfWidth.name, KnownKind::column, false, "half width of the setting device"},
    {"sd_centreline_mm", "centreline_mm", KnownKind::value, true, "turning axis"},
    {"sd_C_tilt_rad", "C_tilt_rad", KnownKind::value, true}};
constexpr Quantity kSetterResults[]{quantity::kToolOffset,  quantity::kSetter,      quantity::kLink,
                                    quantity::kToolOffsetX, quantity::kToolOffsetZ, quantity::kSetterX,
                                    quantity::kSetterZ,     quantity::kLinkX};
constexpr Quantity kSetterFurther[]{quantity::kEachB};
constexpr std::string_view kSetterUnobservable[]{
    "an error of probe_offset_mm: it biases tool and setting device with unit sensitivity",
    "Y of the tool, its height against the turning axis, where the machine has no Y to touch along"};

// Axes along which the device was touched from one side alone; none of the third, where it stands.
std::optional<std::string> oneFaced(const Dataset& dataset) {
  const Table* touches = dataset.table("touches");
  if (touches == nullptr || dataset.table("readings") != nullptr) return std::nullopt;
  std::string axes;
  for (const auto& [column, axis] : {std::pair{column::kNormalX, "X"}, std::pair{column::kNormalY, "Y"}}) {
    const auto* normals = touches->column(column);
    if (normals == nullptr) return std::nullopt;
    const auto [least, most] = std::ranges::minmax(*normals);
    if ((least < -0.1 && most > 0.1) || (least == 0.0 && most == 0.0)) continue;
    axes.append(axes.empty() ? "" : " and ").append(axis);
  }
  if (axes.empty()) return std::nullopt;
  return "along " + axes +
         " one face was touched: an error of half_width_mm is in setter_mm there, one of stylus_ball_radius_mm in "
         "tool_offset_mm, and the offset is that of the edge that touched, with the radius of the tool's nose unknown";
}

// link_mm alone is relative to it.
constexpr MethodKey kNotOfTool[]{kCentrelineResult};

std::optional<Subject> subjectOfTool(const Dataset& dataset) {
  return numberedSubject(dataset, SubjectKind::tool, "tool");
}

std::vector<NamedSubject> alsoSetter(const Dataset& dataset) {
  const auto device = readDevice(dataset);
  const auto& needs = device && isFlat(*device) ? quantity::kSetterX : quantity::kSetter;
  return {{.name = text(Subject{SubjectKind::setter}), .needs = std::string{needs}}};
}

}  // namespace

const Method kToolSetter{.name = "tool-setter",
                         .title = "Offset of a tool from a setting device",
                         .equations = "(B22)-(B22c)",
                         .source = source::kMachine,
                         .solver = solveToolSetter,
                         .tables = kSetterTables,
                         .keys = kSetterKeys,
                         .known = kSetterKnown,
                         .results = kSetterResults,
                         .further = kSetterFurther,
                         .unobservable = kSetterUnobservable,
                         .undetermined = oneFaced,
                         .subject = {.of = subjectOfTool, .independent_of = kNotOfTool},
                         .also_about = alsoSetter};

}  // namespace probebox::metrology
