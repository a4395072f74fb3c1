#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

// Common parts of the measurements of tools: tool_assembly.hpp, tool_setter.hpp.
namespace probebox::metrology {

// True if any flag of the column is set. Refuses, under `name`, a flag that is neither 0 nor 1.
Outcome<bool, Refusal> anySet(const std::vector<double>& flags, std::string_view column, const char* name);

// Means of three coordinates of each of `groups` kinds of rows, mm, with one pooled sigma.
Outcome<Fit, Refusal> fitMeans(const Eigen::MatrixX3d& positions, const std::vector<std::size_t>& group,
                               std::size_t groups, double sigma);

}  // namespace probebox::metrology
