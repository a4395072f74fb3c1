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

// What the datum features have in common (docs/metrology.md B.0 and B.0b): points that are centres of the stylus ball.

// Columns x_mm, y_mm, z_mm of a table, a row a point.
Rows3 pointRows(const Table& table);

// Refuses two points that are equal to the last digit (duplicated-reading): a copy is not a reading.
std::optional<Refusal> equalPoints(const Eigen::MatrixXd& points);

// Widths of a cloud of points about its mean, the least first: roots of the eigenvalues of its scatter. Good to 1e-7 of
// the largest.
Eigen::VectorXd widthsOf(const Eigen::MatrixXd& points);

// Refuses the worst point of a fit, one residual a point, when it lies more than 4 sigma off (residual-too-large).
// off_what: "the sphere".
std::optional<Refusal> pointOff(const Fit& fit, double sigma, std::string_view off_what,
                                std::string_view remedy = "touch it again");

// The remedy where the method has a key for it.
inline constexpr std::string_view kAgainOrRobust = "touch it again, or set robust to drop it";

// What one reading is in design figures of points.
inline constexpr const char* kOnePoint = "one point along its normal, mm";

// Residuals of a fit with one row a point. sense: -1 where the fit has fitted minus read (linear ones).
Residuals pointResiduals(const Fit& fit, double sigma, double sense = 1.0);

}  // namespace probebox::metrology
