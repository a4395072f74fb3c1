#include "firmware/metrology/features/face_fit.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/points.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kMiddle{.key = "middle_mm", .about = "along width_direction"};
constexpr Quantity kEffectiveWidth{.key = "effective_width_mm", .about = "between stylus-ball centres"};
constexpr Quantity kWidth{.key = "width_mm", .about = "the feature's own, with stylus_ball_radius_mm"};
constexpr Quantity kSquareError{.key = "square_error_rad", .kind = QuantityKind::error};

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr MethodColumn kFace{"face", ColumnRole::number};
constexpr MethodColumn kPointColumns[]{kFace, column::kX, column::kY, column::kZ};
constexpr MethodColumn kFaceColumns[]{kFace, column::kNormalX, column::kNormalY, column::kNormalZ};
constexpr double kNominal = 0.866;    // cosine of 30 degrees
constexpr double kLeastVolume = 0.1;  // of the normals: 6 degrees between two
// Thickness of a face's points against their width, width against their distance.
constexpr double kStraightFace = 0.01;
constexpr double kLeastWidth = 1.0;  // mm, root of the summed squares

// Points of one face.
struct Face {
  VectorXd normal;  // outward, nominal
  MatrixXd points;  // a row a point
  std::vector<std::size_t> rows;
  VectorXd mean() const { return points.colwise().mean().transpose(); }
};

Refusal missingFace(double face) {
  return {"missing-face", "face " + text(face) + " has no points: touch it too"};
}

enum class Material { web, pocket };

std::optional<Refusal> badFaces(const std::vector<double>& faces) {
  for (std::size_t row = 0; row < faces.size(); ++row) {
    if (faces[row] != 1.0 && faces[row] != 2.0) {
      return Refusal{"bad-face", "table 'points', row " + std::to_string(row + 1) + ": face must be 1 or 2"};
    }
  }
  for (const double face : {1.0, 2.0}) {
    if (std::ranges::find(faces, face) == faces.end()) return missingFace(face);
  }
  return std::nullopt;
}

// Scatter of each coordinate about its mean on either face, mm. design: a column a face, 1 for its points.
Eigen::Vector3d scatterOnFaces(const Rows3& points, const MatrixXd& design) {
  const Eigen::RowVectorXd counts = design.colwise().sum();
  const MatrixXd means = counts.cwiseInverse().asDiagonal() * (design.transpose() * points);
  const auto spare = static_cast<double>(points.rows() - 2);
  return ((points - design * means).colwise().squaredNorm().transpose() / spare).cwiseSqrt();
}

Outcome<Result, Refusal> solveWidth(const Dataset& dataset, Material material) {
  TRY(const auto given, configDirection(dataset, "width_direction"));
  if (!given) {
    return Refusal{"missing-key", "config.json has no key 'width_direction': give the direction across the faces"};
  }
  const Eigen::Vector3d& direction = *given;
  TRY(const auto stylus, configPositive(dataset, "stylus_ball_radius_mm"));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto table, checkedTable(dataset, "points", kPointColumns));
  const auto& faces = *table->column(kFace);
  if (auto refusal = badFaces(faces)) return *refusal;
  const Rows3 points = pointRows(*table);
  if (auto refusal = equalPoints(points)) return *refusal;

  const Eigen::Vector3d along = direction.normalized();
  MatrixXd design = MatrixXd::Zero(points.rows(), 2);
  for (Index i = 0; i < points.rows(); ++i) design(i, faces[static_cast<std::size_t>(i)] == 1.0 ? 0 : 1) = 1.0;
  TRY(const auto fit, linearLeastSquares(design / sigma.value, points * along / sigma.value));
  if (sigma.stated) {
    if (auto refusal = pointOff(fit, sigma.value, "its face")) return *refusal;
  }
  const double apart = fit.parameters[1] - fit.parameters[0];
  const Eigen::RowVector2d across = Eigen::RowVector2d{-1.0, 1.0} * (apart < 0.0 ? -1.0 : 1.0);
  const double both = 2.0 * stylus.value_or(0.0);
  const double width = std::abs(apart) + (material == Material::web ? -both : both);
  if (width <= 0.0) {
    return Refusal{"width-not-positive", "the width comes to " + text(width) +
                                             " mm: check stylus_ball_radius_mm, and whether it is a web or a pocket"};
  }
  Answer answer{dataset, fit, sigma};
  answer.result().design_per = kOnePoint;
  answer.result().residuals = pointResiduals(fit, sigma.value, -1.0);
  answer.promiseScalar(kMiddle, fit.parameters.mean(), Eigen::RowVector2d{0.5, 0.5});
  answer.promiseScalar(kEffectiveWidth, std::abs(apart), across);
  if (stylus) answer.promiseScalar(kWidth, width, across);
  answer.result().convention = "middle along width_direction; effective width: between stylus-ball centres";
  const auto rounding = roundingOfMeans(
      *table, {std::span{kPointColumns}.last(3), scatterOnFaces(points, design), along.cwiseAbs()}, sigma, answer);
  MatrixXd slopes{stylus ? 3 : 2, 2};
  slopes << Eigen::RowVector2d{0.5, 0.5}, across.replicate(slopes.rows() - 1, 1);
  Result result = std::move(answer).take(true);
  widen(result, slopes, Eigen::Vector2d::Constant(rounding.sd_mm.norm()));
  return result;
}

// The faces of a corner in the dimensions in which they are fitted: two in a plane, three in space.
struct Corner {
  std::vector<Face> faces;
  Index dimensions() const { return static_cast<Index>(faces.size()); }
};

// How far the points lie apart along the face, greatest first.
VectorXd widthsOf(const Face& face) {
  const MatrixXd centred = face.points.rowwise() - face.mean().transpose();
  const MatrixXd along = centred - centred * face.normal * face.normal.transpose();
  return singularValues(along);
}

Refusal collinear(const std::string& face) {
  return {"collinear", "the points of " + face +
                           " lie close to one point or one line, or together far from the corner: they do not "
                           "determine the direction of the face; spread them out"};
}

std::optional<Refusal> badFace(const Face& face, double name) {
  if (face.points.rows() < face.normal.size()) {
    return Refusal{"too-few-readings", "face " + text(name) + " has " + std::to_string(face.points.rows()) +
                                           " points where it needs " + std::to_string(face.normal.size()) +
                                           ": touch it at more places"};
  }
  const VectorXd widths = widthsOf(face);
  const Index last = face.normal.size() - 2;  // the widths that a line or a plane needs
  if (widths[0] >= kLeastWidth && widths[last] >= kStraightFace * widths[0]) return std::nullopt;
  return collinear("face " + text(name));
}

Outcome<Corner, Refusal> cornerOf(const Table& points, const Table& faces, const SwivelPlane& plane) {
  if (faces.rows() != 2 && faces.rows() != 3) {
    return Refusal{"bad-face",
                   "table 'faces' has " + std::to_string(faces.rows()) + " rows: a corner has two or three"};
  }
  MatrixXd into = MatrixXd::Identity(3, 3);
  if (faces.rows() == 2) into = (MatrixXd{3, 2} << into.col(plane.low()), into.col(plane.high())).finished();
  const auto& names = *faces.column(kFace);
  const auto& of_point = *points.column(kFace);
  const Rows3 all = pointRows(points);
  Corner corner;
  for (std::size_t row = 0; row < faces.rows(); ++row) {
    const Eigen::Vector3d normal{(*faces.column(column::kNormalX))[row], (*faces.column(column::kNormalY))[row],
                                 (*faces.column(column::kNormalZ))[row]};
    const VectorXd seen = into.transpose() * normal;
    if (std::abs(normal.norm() - 1.0) > kUnitLength || seen.norm() < kNominal) {
      return Refusal{"bad-direction",
                     "table 'faces', row " + std::to_string(row + 1) +
                         ": the normal must have length 1 and, for two faces, lie across feature_axis"};
    }
    Face face{.normal = seen.normalized(), .points = {}, .rows = {}};
    for (std::size_t k = 0; k < of_point.size(); ++k) {
      if (of_point[k] == names[row]) face.rows.push_back(k);
    }
    if (face.rows.empty()) return missingFace(names[row]);
    face.points = all(face.rows, Eigen::all) * into;
    if (auto refusal = badFace(face, names[row])) return *refusal;
    corner.faces.push_back(std::move(face));
  }
  std::size_t used = 0;
  for (const auto& face : corner.faces) used += face.rows.size();
  if (used != of_point.size())
    return Refusal{"bad-face",
                   "table 'points' names a face that table 'faces' does not list, or lists twice: list each face once"};
  return corner;
}

// One face at given parameters: how its normal leans off the nominal one, then its distance from the mean point.
struct Leaning {
  VectorXd normal;
  MatrixXd slopes;  // of the normal, a column a parameter; none for the distance
};

Leaning leaning(const Face& face, const VectorXd& parameters) {
  const Index n = face.normal.size();
  const MatrixXd across = complementOf(face.normal);
  const VectorXd direction = face.normal + across * parameters.head(n - 1);
  const VectorXd normal = direction.normalized();
  const MatrixXd slopes = (across - normal * (normal.transpose() * across)) / direction.norm();
  return {normal, slopes};
}

Outcome<Fit, Refusal> fitFaces(const Corner& corner, Index rows, double sigma) {
  const Index n = corner.dimensions();
  return leastSquares(
      [&](const VectorXd& at) {
        Linearised model{VectorXd{rows}, MatrixXd::Zero(rows, n * n)};
        for (Index f = 0; f < n; ++f) {
          const Face& face = corner.faces[static_cast<std::size_t>(f)];
          const Leaning lean = leaning(face, at.segment(n * f, n));
          for (Index i = 0; i < face.points.rows(); ++i) {
            const VectorXd off = face.points.row(i).transpose() - face.mean();
            const auto row = static_cast<Index>(face.rows[static_cast<std::size_t>(i)]);
            model.residuals[row] = (lean.normal.dot(off) - at[n * f + n - 1]) / sigma;
            model.jacobian.row(row).segment(n * f, n - 1) = off.transpose() * lean.slopes / sigma;
            model.jacobian(row, n * f + n - 1) = -1.0 / sigma;
          }
        }
        return model;
      },
      VectorXd::Zero(n * n));
}

// Where the faces meet, moved in by the stylus' radius, and how that follows from the parameters of the faces.
struct Meeting {
  VectorXd corner;
  MatrixXd slopes;
  double square{};  // angle between the first two normals less a right one
  Eigen::RowVectorXd square_slopes;
};

Outcome<Meeting, Refusal> meet(const Corner& corner, const VectorXd& parameters, double stylus) {
  const Index n = corner.dimensions();
  MatrixXd normals{n, n};
  VectorXd distances{n};
  std::vector<Leaning> leans;
  for (Index f = 0; f < n; ++f) {
    const Face& face = corner.faces[static_cast<std::size_t>(f)];
    leans.push_back(leaning(face, parameters.segment(n * f, n)));
    if (leans.back().normal.dot(face.normal) < kNominal) {
      return Refusal{"bad-direction", "row " + std::to_string(f + 1) +
                                          " of table 'faces': the points lie more than 30 degrees off its normal; "
                                          "check whether faces are exchanged"};
    }
    normals.row(f) = leans.back().normal.transpose();
    distances[f] = leans.back().normal.dot(face.mean()) + parameters[n * f + n - 1] - stylus;
  }
  if (std::abs(determinant(normals)) < kLeastVolume) {
    return Refusal{"faces-parallel",
                   "the faces are nearly parallel and form no corner: touch faces at a larger angle to each other"};
  }
  const MatrixXd inverted = inverse(normals);
  Meeting meeting{inverted * distances, MatrixXd::Zero(n, n * n), 0.0, Eigen::RowVectorXd::Zero(n * n)};
  for (Index f = 0; f < n; ++f) {
    Eigen::RowVectorXd shift = Eigen::RowVectorXd::Ones(n);  // of the face at the corner
    const Face& face = corner.faces[static_cast<std::size_t>(f)];
    const VectorXd arm = face.mean() - meeting.corner;
    if (widthsOf(face)[0] < kStraightFace * arm.norm())
      return collinear("row " + std::to_string(f + 1) + " of table 'faces'");
    shift.head(n - 1) = arm.transpose() * leans[static_cast<std::size_t>(f)].slopes;
    meeting.slopes.middleCols(n * f, n) = inverted.col(f) * shift;
  }
  const double cosine = normals.row(0).dot(normals.row(1));
  const double sine = std::sqrt(1.0 - cosine * cosine);
  meeting.square = -std::asin(cosine);
  meeting.square_slopes.head(n - 1) = -normals.row(1) * leans[0].slopes / sine;
  meeting.square_slopes.segment(n, n - 1) = -normals.row(0) * leans[1].slopes / sine;
  return meeting;
}

}  // namespace

Outcome<Result, Refusal> solveWebFit(const Dataset& dataset) {
  return solveWidth(dataset, Material::web);
}

Outcome<Result, Refusal> solvePocketFit(const Dataset& dataset) {
  return solveWidth(dataset, Material::pocket);
}

Outcome<Result, Refusal> solveCornerFit(const Dataset& dataset) {
  TRY(const auto stylus, requiredPositive(dataset, "stylus_ball_radius_mm"));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto plane, planeAcross(dataset, "feature_axis"));
  TRY(const auto points, checkedTable(dataset, "points", kPointColumns));
  TRY(const auto faces, checkedTable(dataset, "faces", kFaceColumns));
  if (auto refusal = equalPoints(pointRows(*points))) return *refusal;
  TRY(const auto corner, cornerOf(*points, *faces, plane));
  TRY(const auto fit, fitFaces(corner, static_cast<Index>(points->rows()), sigma.value));
  TRY(const auto meeting, meet(corner, fit.parameters, stylus));
  if (sigma.stated) {
    if (auto refusal = pointOff(fit, sigma.value, "its face")) return *refusal;
  }
  Answer answer{dataset, fit, sigma};
  answer.result().design_per = kOnePoint;
  answer.result().residuals = pointResiduals(fit, sigma.value);
  const std::string key = corner.dimensions() == 2 ? "corner_" + plane.name() + "_mm" : "corner_mm";
  answer.promiseVector(key, meeting.corner, meeting.slopes);
  answer.alsoScalar(kSquareError, meeting.square, meeting.square_slopes);
  answer.result().convention =
      "square error: angle between the outward normals of the first two faces minus 90 degrees";
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kWidthTables[]{
    {"points", kPointColumns, "a stylus-ball centre at contact with face 1 or 2", false, true}};
constexpr MethodKey kWidthKeys[]{
    {"width_direction", kNeeded, "unit vector across the faces"}, key::kSigma, key::kStylusRadius};
constexpr Quantity kWidthResults[]{kMiddle, kEffectiveWidth, kWidth};
constexpr std::string_view kWidthUnobservable[]{
    "anything across the stated width_direction, and how far the faces are from parallel"};
constexpr MethodTable kCornerTables[]{
    {"points", kPointColumns, "a stylus-ball centre at contact with that face", false, true},
    {"faces", kFaceColumns, "outward normal of a face, within 30 degrees"}};
constexpr MethodKey kCornerKeys[]{
    MethodKey{key::kStylusRadius.name, kNeeded, "radius of the stylus ball: each face is moved inwards by it"}.within(
        key::kStylusRadius.least, key::kStylusRadius.most),
    key::kSigma, key::kFeatureAxis};
constexpr Quantity kCornerResults[]{
    {"corner_xy_mm", "corner of two faces across Z; corner_yz_mm or corner_xz_mm across X or Y"},
    {"corner_mm", "corner of three faces"}};
constexpr Quantity kCornerFurther[]{kSquareError};
constexpr std::string_view kCornerUnobservable[]{"form of the faces separately from the noise of the readings"};

}  // namespace

const Method kWebFit{.name = "web-fit",
                     .title = "Middle and width of a web",
                     .equations = "(B3b)",
                     .source = source::kMachine,
                     .solver = solveWebFit,
                     .tables = kWidthTables,
                     .keys = kWidthKeys,
                     .known = kStylusRadiusKnown,
                     .results = kWidthResults,
                     .unobservable = kWidthUnobservable};

const Method kPocketFit{.name = "pocket-fit",
                        .title = "Middle and width of a pocket",
                        .equations = "(B3b)",
                        .source = source::kMachine,
                        .solver = solvePocketFit,
                        .tables = kWidthTables,
                        .keys = kWidthKeys,
                        .known = kStylusRadiusKnown,
                        .results = kWidthResults,
                        .unobservable = kWidthUnobservable};

const Method kCornerFit{.name = "corner-fit",
                        .title = "Corner of two or three faces",
                        .equations = "(B3c)",
                        .source = source::kMachine,
                        .solver = solveCornerFit,
                        .tables = kCornerTables,
                        .keys = kCornerKeys,
                        .known = kStylusRadiusKnown,
                        .results = kCornerResults,
                        .further = kCornerFurther,
                        .unobservable = kCornerUnobservable};

}  // namespace probebox::metrology
