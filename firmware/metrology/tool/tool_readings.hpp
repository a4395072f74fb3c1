#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

// Common parts of the measurements of tools: tool_assembly.hpp, tool_setter.hpp.
namespace probebox::metrology {

// True if any flag of the column is set. Refuses, under `name`, a flag that is neither 0 nor 1.
Outcome<bool, Refusal> anySet(const std::vector<double>& flags, const std::string& column, const char* name);

// Means of three coordinates of each of `groups` kinds of rows, mm, with one pooled sigma.
Outcome<Fit, Refusal> fitMeans(const Eigen::MatrixX3d& positions, const std::vector<std::size_t>& group,
                               std::size_t groups, double sigma);

// sd (k = 1), mm, that rounding leaves in the mean of repeats at one place: common to them, so neither do they average
// it out nor does their scatter show it. columns: measured, mm. Adds a warning where it counts; 0 where a sigma is
// stated, no sd is known, or noise averages the rounding out.
double roundingOfMeans(const Table& table, std::span<const std::string_view> columns, const Sigma& sigma,
                       Answer& answer);

// Adds the uncertainty of inputs outside the fit to every sd and to the covariance. slopes: one row per promised value,
// in the order of the estimates, one column per input. sds: of the inputs.
void widen(Result& result, const Eigen::MatrixXd& slopes, const Eigen::VectorXd& sds);

}  // namespace probebox::metrology
