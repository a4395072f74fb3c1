#pragma once
#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/line.hpp"

namespace probebox::metrology {

// Common parts of the datum features (docs/metrology.md B.0 and B.0b): points are centres of the stylus ball.

// Columns x_mm, y_mm, z_mm of a table, one row per point.
Rows3 pointRows(const Table& table);

// Refuses two points that are equal in every digit (duplicated-reading): a copied reading is not independent.
std::optional<Refusal> equalPoints(const Eigen::MatrixXd& points);

// Principal widths of a cloud of points about its mean, smallest first: square roots of the eigenvalues of its scatter.
// Accurate to 1e-7 of the largest.
Eigen::VectorXd widthsOf(const Eigen::MatrixXd& points);

// Refuses the worst point of a fit when its residual exceeds 4 sigma, or what the worst of so many honest ones exceeds
// once in a thousand tables, if that is more (residual-too-large). off_what: "the sphere".
std::optional<Refusal> pointOff(const Fit& fit, double sigma, std::string_view off_what,
                                std::string_view remedy = "touch it again");

// Remedy for methods with a key for it.
inline constexpr std::string_view kAgainOrRobust = "touch it again, or set robust to drop it";

// Name of one reading in design figures of points.
inline constexpr const char* kOnePoint = "one point along its normal, mm";

// Residuals of a fit with one row per point. sense: -1 if the fit has fitted minus measured (linear ones).
Residuals pointResiduals(const Fit& fit, double sigma, double sense = 1.0);

}  // namespace probebox::metrology
