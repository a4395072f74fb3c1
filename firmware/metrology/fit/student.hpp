#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace probebox::metrology {

// Variance of a reading by the residuals of its own fit, where no sigma is stated: s^2 n/(n - 2) with n degrees of
// freedom, so that errors in units of the sd have the variance 1 (Student's t; JCGM 101, 6.4.9.4). Nothing up to two
// degrees, where t has no variance.
std::optional<double> varianceFromResiduals(double sum_of_squares, std::size_t dof);

// Explains why there is no sd. key: "sigma_mm".
std::string noSdWarning(std::size_t dof, std::string_view key);

}  // namespace probebox::metrology
