#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host-tests/metrology/ball_plate.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/checked_machine.hpp"
#include "host-tests/metrology/heated_screw.hpp"
#include "host-tests/metrology/large_chuck.hpp"
#include "host-tests/metrology/mill_turn.hpp"
#include "host-tests/metrology/pivoted_head.hpp"
#include "host-tests/metrology/sensor_heads.hpp"
#include "host-tests/metrology/setter_cases.hpp"
#include "host-tests/metrology/shift_simulation.hpp"
#include "host-tests/metrology/swivelling_head.hpp"
#include "host-tests/metrology/tilting_table.hpp"
#include "host-tests/metrology/touched_features.hpp"
#include "host-tests/metrology/turned_feature.hpp"
#include "host-tests/silent/worlds.hpp"

// Methods that read places: of balls, of contacts, of a screw.
namespace probebox::metrology::silent {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Case = std::optional<SimulatedCase>;

std::vector<double> list(const auto& vector) {
  return {vector.begin(), vector.end()};
}

// Of a probe that reads balls: neither the sample of a deflection, nor a single side.
bool readsBallsAsWell(const Errors& errors) {
  return !errors.has(Err::curvature) && !errors.has(Err::lobing) && !errors.has(Err::wrong_ball);
}

const std::array<std::string, 3> kInPlane{"x_mm", "y_mm", ""};

// ---- The turning axis

Case centreline(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const Vector2d centre{uniform(random, 100, 300), uniform(random, 100, 200)};
  std::vector<double> angles;
  for (int k = 0; k <= 12; ++k) angles.push_back(kTurn * k / 12);
  Dataset dataset = centrelineDataset(turnedFeature(centre, {60, 10}, angles, kNoise_mm, 0, random), kNoise_mm);
  dataset.config["time_per_reading_s"] = 60.0;
  // Its drift is taken out, and the centre is that of the middle of the time.
  disturb(dataset, {{"readings", kInPlane}}, {centre.x(), centre.y(), 0}, errors, random, 6);
  return SimulatedCase{std::move(dataset), {{"centre_mm", list(centre)}}};
}

Case limitedAccess(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const ReachedChuck chuck = randomReachedChuck(random);
  Dataset dataset = rimDataset(chuck, fiveAngles(40 * kDegree), kNoise_mm, 0, random);
  disturb(dataset, {{"readings", kInPlane}}, {chuck.centre.x(), chuck.centre.y(), 0}, errors, random);
  return SimulatedCase{std::move(dataset), {{"centre_mm", list(chuck.centre)}, {"radius_mm", {chuck.radius}}}};
}

Case bySteps(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  Chuck chuck = randomChuck(random);
  chuck.sigma = kNoise_mm;
  Dataset dataset = goThrough(chuck, 40 * kDegree, random);
  disturb(dataset, {{"stylus", kInPlane}, {"readings", kInPlane}}, {chuck.centre.x(), chuck.centre.y(), 0}, errors,
          random);
  return SimulatedCase{std::move(dataset), {{"centre_mm", list(chuck.centre)}}};
}

Case ofAxes(std::string method, const std::string& lever, std::vector<Row> rows, const Machine& machine,
            const Errors& errors, Random& random, std::vector<Truth> truth) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  blur(rows, kNoise_mm, random);
  Dataset dataset = ballDataset(std::move(method), lever, rows, kNoise_mm);
  // The length of a tip is no place.
  disturb(dataset, {{"readings", {"x_mm", "y_mm", lever == "z_mm" ? lever : ""}}},
          {machine.c_point.x(), machine.c_point.y(), 120}, errors, random);
  return SimulatedCase{std::move(dataset), std::move(truth)};
}

Case cAlignment(const Errors& errors, Random& random) {
  Machine machine = randomMachine(random, 2e-4);
  machine.spindle_tilt.setZero();
  return ofAxes("c-axis-alignment", "z_mm", readAtHeights(grid({80, 120, 160}, kOpposed, kOpposed), machine), machine,
                errors, random, {{"C_tilt_rad", list(machine.c_tilt)}});
}

Case aAlignment(const Errors& errors, Random& random) {
  const Machine machine = randomMachine(random, 2e-4);
  return ofAxes("a-axis-alignment", "tip_length_mm", readWithTips(grid({100, 140, 180}, kOpposed, kOpposed), machine),
                machine, errors, random, {{"A_tilt_rad", list(machine.spindle_tilt)}});
}

Case offset2x2(const Errors& errors, Random& random) {
  const Machine machine = randomMachine(random, 0);
  return ofAxes("spindle-offset-2x2", "", metrology::read(grid({0}, kOpposed, kOpposed), machine), machine, errors,
                random,
                {{"offset_C_minus_A_mm", list(machine.c_point.head<2>())}, {"stylus_offset_mm", list(machine.stylus)}});
}

Case offsetFour(const Errors& errors, Random& random) {
  const Machine machine = randomMachine(random, 0);
  std::vector<Row> rows;
  for (int k = 0; k < 4; ++k) rows.push_back({0, kPi / 2 * k, kPi / 2 * k, {}});
  return ofAxes("spindle-offset-four", "", metrology::read(std::move(rows), machine), machine, errors, random,
                {{"offset_C_minus_A_mm", list(machine.c_point.head<2>())}});
}

Case periodicCheck(const Errors& errors, Random& random) {
  if (errors.has(Err::curvature)) return std::nullopt;
  CheckedMachine machine;
  machine.centreline = {uniform(random, -.02, .02), uniform(random, -.02, .02), 0};
  machine.x_offset_error = uniform(random, -.03, .03);
  machine.z_offset_error = uniform(random, -.03, .03);
  Dataset dataset = checkOf(machine, kNoise_mm, random);
  if (errors.has(Err::wrong_ball))
    std::get<double>(dataset.config["effective_ball_radius_mm"]) += errors.size * kBall_mm / 2;
  disturb(dataset,
          {{"centres"},
           {"x_touch", {"x_mm", "", ""}, [](std::size_t) { return Vector3d::UnitX(); }},
           {"z_touch", {"", "", "z_mm"}, [](std::size_t) { return Vector3d::UnitZ(); }}},
          {machine.centreline.x(), machine.centreline.y(), kExpectedZ}, errors, random);
  return SimulatedCase{std::move(dataset),
                       {{"Ycen_B90_mm", {machine.centreline.y()}},
                        {"Xcen_B0_mm", {machine.centreline.x()}},
                        {"Ycen_B0_mm", {machine.centreline.y()}},
                        {"Ycen_B45_mm", {machine.centreline.y()}},
                        {"x_offset_error_mm", {machine.x_offset_error}},
                        {"z_offset_error_mm", {machine.z_offset_error}}}};
}

// ---- Tilts

Vector3d middleOf(const Dataset& dataset, const std::string& table) {
  Vector3d middle = Vector3d::Zero();
  constexpr std::array kNames{"x_mm", "y_mm", "z_mm"};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& values = *dataset.table(table)->column(kNames.at(k));
    for (const double value : values)
      middle[static_cast<Eigen::Index>(k)] += value / static_cast<double>(values.size());
  }
  return middle;
}

Case headPivot(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  PivotedHead head;
  head.pivot = {uniform(random, -.1, .1), 0, uniform(random, -200, -80)};
  Dataset dataset = pivotDataset(head, kNoise_mm, random);
  disturb(dataset, {{"readings"}}, middleOf(dataset, "readings"), errors, random);
  return SimulatedCase{std::move(dataset), {{"pivot_xz_mm", {head.pivot.x(), head.pivot.z()}}}};
}

template <bool in_space>
Case tablePivot(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const Tilting table = randomTable(random, 1e-4);
  Dataset dataset = tableDataset(table, {-90, -45, 0}, {0, 180}, kNoise_mm, random);
  if (in_space) dataset.method = "table-pivot-3d";
  disturb(dataset, {{"readings"}}, table.pivot, errors, random);
  std::vector<Truth> truth{{"lean_yz_rad", {table.skew.y(), table.skew.z()}}};
  // In space it is that of the middle along the axis.
  if (!in_space) truth.push_back({"pivot_yz_mm", {table.pivot.y(), table.pivot.z()}});
  return SimulatedCase{std::move(dataset), std::move(truth)};
}

Case swivelError(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const Head head = randomHead(random);
  Dataset dataset = swivelDataset(head, {-90, -45, 0, 45, 90}, {100, 200}, kNoise_mm, random);
  disturb(dataset, {{"readings"}}, middleOf(dataset, "readings"), errors, random);
  std::vector<double> truth;
  for (const double length : {100.0, 150.0, 200.0})
    for (const double b : kQueryAngles)
      for (const double part : head.error(b, length)) truth.push_back(part);
  return SimulatedCase{std::move(dataset), {{"error_at_queries_mm", std::move(truth)}}};
}

// Angle after angle, as the table turns.
void sortByAngle(Table& first) {
  std::vector<std::size_t> rows(first.rows());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = k;
  const auto angles = *first.column("phi_rad");
  std::ranges::stable_sort(rows, {}, [&](std::size_t row) { return angles[row]; });
  for (auto& column : first.columns) {
    auto values = column.values;
    for (std::size_t k = 0; k < rows.size(); ++k) column.values[k] = values[rows[k]];
  }
}

Case rotaryErrors(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors) || errors.has(Err::run_out)) return std::nullopt;  // run-out is in the answer
  RotaryTable table = randomTable(std::size_t{8}, random);
  Dataset dataset = rotaryDataset(table, plateOf(4, 120), kNoise_mm, random);
  sortByAngle(tableNamed(dataset, "first"));
  disturb(dataset, {{"second"}, {"first"}}, {0, 0, 50}, errors, random);
  // Of one angle: of all of them some value is beyond four sd by chance.
  constexpr std::size_t kAngle = 3;
  std::vector<double> six(6 * kAngle, std::nan(""));
  six.insert(six.end(), table.errors[kAngle].begin(), table.errors[kAngle].end());
  return SimulatedCase{std::move(dataset), {{"six_errors", std::move(six)}}};
}

Case sensorHead(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const Sensors sensors = randomSensors(random);
  Dataset dataset = headDataset(sensors, 0.3, kNoise_mm, random, {});
  disturb(dataset, {{"moves", {"ux_mm", "uy_mm", "uz_mm"}}}, Vector3d::Zero(), errors, random);
  std::vector<double> truth;
  for (Eigen::Index k = 0; k < 9; ++k) truth.push_back(sensors.matrix(k / 3, k % 3));
  return SimulatedCase{std::move(dataset), {{"sensor_matrix", std::move(truth)}}};
}

// ---- Tools

Case setterByBalls(const Errors& errors, Random& random) {
  if (!readsBallsAsWell(errors)) return std::nullopt;
  const Setter setter{.at = anywhere(random, 100), .tool = anywhere(random, 60) + Vector3d{0, 0, 125}};
  Dataset dataset = setterDataset(setter, 3, kNoise_mm, random);
  disturb(dataset, {{"readings"}}, setter.reading(setter.probe), errors, random);
  return SimulatedCase{std::move(dataset), {{"tool_offset_mm", list(setter.tool)}}};
}

std::function<Vector3d(std::size_t)> normalsIn(const Dataset& dataset, const std::string& table) {
  return [touches = *dataset.table(table)](std::size_t row) {
    return Vector3d{(*touches.column("nx"))[row], (*touches.column("ny"))[row], (*touches.column("nz"))[row]};
  };
}

Case setterByFaces(const Errors& errors, Random& random) {
  if (errors.has(Err::curvature)) return std::nullopt;
  const Setter setter{.at = anywhere(random, 100), .tool = anywhere(random, 60) + Vector3d{0, 0, 125}};
  Dataset dataset = faceDataset(setter, kNoise_mm, random);
  if (errors.has(Err::wrong_ball)) {
    const auto is_tool = columnNamed(dataset, "touches", "is_tool");
    for (std::size_t row = 0; row < is_tool.size(); ++row)
      if (is_tool[row] == 0) columnNamed(dataset, "touches", "radius_mm")[row] += errors.size * kBall_mm / 2;
  }
  const auto normals = normalsIn(dataset, "touches");
  const auto is_tool = columnNamed(dataset, "touches", "is_tool");
  const auto side = [=](std::size_t row) -> Vector3d {
    // A tool has no lobes.
    return errors.has(Err::lobing) && is_tool[row] == 1 ? Vector3d::Zero() : normals(row);
  };
  disturb(dataset, {{"touches", {"x_mm", "y_mm", "z_mm"}, side}}, setter.reading(setter.probe), errors, random);
  return SimulatedCase{std::move(dataset), {{"tool_offset_mm", list(setter.tool)}}};
}

Case assembly(const Errors& errors, Random& random) {
  if (errors.has(Err::curvature) || errors.has(Err::lobing) || errors.has(Err::wrong_ball)) return std::nullopt;
  Assembly truth;
  truth.holder = uniform(random, 60, 100);
  truth.assembled = uniform(random, 20, 80);
  truth.tool = truth.holder + truth.assembled - uniform(random, -2, 2);
  Dataset dataset = assemblyDataset(truth, 4, kNoise_mm, random);
  const Vector3d side = -Vector3d::Ones();  // each face from one side
  disturb(dataset, {{"readings", {"W0_x_mm", "W0_y_mm", "L0_z_mm"}, [side](std::size_t) { return side; }}},
          Vector3d::Zero(), errors, random);
  return SimulatedCase{std::move(dataset), {{"assembled_length_mm", {truth.assembled}}}};
}

// ---- Features

// Single contacts of a piece; outward: normal by place.
Case contacts(Dataset dataset, const Vector3d& about, const std::function<Vector3d(const Vector3d&)>& outward,
              const Errors& errors, Random& random, std::vector<Truth> truth) {
  if (errors.has(Err::curvature)) return std::nullopt;
  if (errors.has(Err::wrong_ball)) {
    if (!dataset.config.contains("stylus_ball_radius_mm")) return std::nullopt;
    std::get<double>(dataset.config["stylus_ball_radius_mm"]) += errors.size * kBall_mm / 2;
  }
  const Table points = tableNamed(dataset, "points");
  const auto side = [&](std::size_t row) {
    return outward({(*points.column("x_mm"))[row], (*points.column("y_mm"))[row], (*points.column("z_mm"))[row]});
  };
  disturb(dataset, {{"points", {"x_mm", "y_mm", "z_mm"}, side}}, about, errors, random);
  return SimulatedCase{std::move(dataset), std::move(truth)};
}

Case sphereFit(const Errors& errors, Random& random) {
  const Ball ball = randomBall(random);
  return contacts(metrology::touched(ball, kNoise_mm, random), ball.centre,
                  [&](const Vector3d& at) { return (at - ball.centre).normalized(); }, errors, random,
                  {{"centre_mm", list(ball.centre)}, {"radius_mm", {ball.radius}}});
}

template <bool bore>
Case roundFit(const Errors& errors, Random& random) {
  const Round round{{uniform(random, -50, 50), uniform(random, -50, 50)}, uniform(random, 5, 60), 1.5, bore};
  const Vector3d about{round.centre.x(), round.centre.y(), -5};
  return contacts(roundDataset(round, {0, 1, 2, 3, 4, 5, 6}, kNoise_mm, random), about,
                  [&](const Vector3d& at) { return Vector3d{(bore ? -1 : 1) * (at - about).normalized()}; }, errors,
                  random, {{"centre_xy_mm", list(round.centre)}, {"radius_mm", {round.radius}}});
}

template <bool web>
Case widthFit(const Errors& errors, Random& random) {
  const double middle = uniform(random, -80, 80), width = uniform(random, 5, 60);
  const Vector3d across = Vector3d::UnitX();
  return contacts(widthDataset(web, middle, width, across, 3, kNoise_mm, random), middle * across,
                  [&](const Vector3d& at) { return Vector3d{(web ? 1 : -1) * (at.x() > middle ? 1 : -1) * across}; },
                  errors, random, {{"middle_mm", {middle}}, {"width_mm", {width}}});
}

Case cornerFit(const Errors& errors, Random& random) {
  const Block block = randomBlock(random, false);
  const auto outward = [&](const Vector3d& at) {
    // The face that it is at.
    const auto off = [&](const Vector3d& normal) { return std::abs(normal.dot(at - block.corner) - block.stylus); };
    return *std::ranges::min_element(block.normals, {}, off);
  };
  return contacts(cornerDataset(block, 5, kNoise_mm, random), block.corner, outward, errors, random,
                  {{"corner_mm", list(block.corner)}});
}

// ---- Screws, and a shift

Case joint(const Errors& errors, Random& random) {
  if (errors.has(Err::curvature) || errors.has(Err::drift)) return std::nullopt;  // its drift is in the answer
  SimulatedShift shift;
  Vector2d centre;
  Dataset dataset = shift.dataset(random, &centre);
  if (errors.has(Err::wrong_ball))
    dataset.config["effective_diameter_mm"] = 2 * shift.radius_mm + errors.size * kBall_mm;
  disturb(dataset, {{"readings", {"x_mm", "y_mm", "z_mm"}, normalsIn(dataset, "readings")}},
          {shift.centre_mm.x(), shift.centre_mm.y(), 140}, errors, random);
  return SimulatedCase{std::move(dataset),
                       {{"tau_s", {shift.tau_s}},
                        {"K_x", {shift.gain_x}},
                        {"K_z", {shift.gain_z}},
                        {"centre_mm", list(centre)},
                        {"C_tilt_rad", list(shift.tilt_rad)}}};
}

// What a nut is shifted by where the half at the fixed bearing is as warm as all would be by the same growth: a share
// of the even shift.
double unevenShare(const Screw& screw, double x_mm) {
  const double share = (x_mm + screw.offset_mm) / screw.length_mm;
  return (1.3 * std::min(share, 0.5) + 0.7 * std::max(share - 0.5, 0.0)) / share;
}

Case screwCalibration(const Errors& errors, Random& random) {
  constexpr double kError_um = 0.2;
  constexpr std::array kNotOfScrew{Err::curvature, Err::lobing,    Err::wrong_ball, Err::squareness,
                                   Err::run_out,   Err::diameters, Err::inches};
  if (std::ranges::any_of(kNotOfScrew, [&](Err err) { return errors.has(err); })) return std::nullopt;
  const Screw screw = randomScrew(random);
  Dataset dataset = calibration(screw, {}, kError_um, random);
  const auto x_mm = columnNamed(dataset, "gain_cal", "x_mm");
  auto& error_um = columnNamed(dataset, "gain_cal", "error_um");
  const double um = 1e3 * errors.size;
  const double scale = uniform(random, 0, 1) < 0.5 ? -kScale : kScale;
  for (std::size_t row = 0; row < x_mm.size(); ++row) {
    const double side = row % 4 == 0 ? 0.5 : -0.5;  // the nut moved back
    if (errors.has(Err::uneven_screw)) error_um[row] *= 1 + errors.size * (unevenShare(screw, x_mm[row]) - 1);
    if (errors.has(Err::scale)) error_um[row] += um * scale * (x_mm[row] - x_mm[0]);
    if (errors.has(Err::drift)) error_um[row] += um * kDrift_mm_per_min * static_cast<double>(row);
    if (errors.has(Err::lost_motion)) error_um[row] += um * kLost_mm * side;
    if (errors.has(Err::hysteresis)) error_um[row] += um * kHysteresis_mm * side;
    if (errors.has(Err::vibration)) error_um[row] += gauss(random, um * kVibration_mm);
  }
  if (errors.has(Err::outlier))
    error_um[std::uniform_int_distribution<std::size_t>{0, error_um.size() - 1}(random)] += 1e3 * kOutlier_mm;
  return SimulatedCase{std::move(dataset), {{"K", {1 / screw.sensor_share}}}};
}

}  // namespace

std::span<const World> worldsOfPlaces() {
  static constexpr World kWorlds[]{
      {"centreline", centreline},
      {"centreline-limited-access", limitedAccess},
      {"centreline-by-steps", bySteps},
      {"c-axis-alignment", cAlignment},
      {"a-axis-alignment", aAlignment},
      {"spindle-offset-2x2", offset2x2},
      {"spindle-offset-four", offsetFour},
      {"periodic-check", periodicCheck},
      {"head-pivot", headPivot},
      {"table-pivot", tablePivot<false>},
      {"table-pivot-3d", tablePivot<true>},
      {"swivel-error", swivelError},
      {"rotary-axis-errors", rotaryErrors, true},
      {"sensor-head-calibration", sensorHead},
      {"tool-setter", setterByBalls},
      {"tool-setter, faces", setterByFaces},
      {"tool-assembly", assembly},
      {"sphere-fit", sphereFit},
      {"boss-fit", roundFit<false>},
      {"bore-fit", roundFit<true>},
      {"web-fit", widthFit<true>},
      {"pocket-fit", widthFit<false>},
      {"corner-fit", cornerFit},
      {"joint", joint, true},
      {"screw-calibration", screwCalibration},
  };
  return kWorlds;
}

}  // namespace probebox::metrology::silent
