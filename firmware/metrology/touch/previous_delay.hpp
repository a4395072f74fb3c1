#pragma once
#include <Eigen/Core>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The delay that the stamps of the machine have been corrected by before they were recorded, s: what is measured then
// is the residual, and the whole delay is previous plus residual (CN101622513, docs/metrology.md A.9).

// "previous_tau_s", or "previous_tau_axis_s" for x, y and z.
std::string_view previousDelayKey(Eigen::Index count);

// Zeros when the key is absent: a number for "previous_tau_s", a list for others. Refuses: bad-config.
Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, std::string_view key, Eigen::Index count);
Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, Eigen::Index count);

// Adds to a result what was measured on top of the previous delay, where there was one.
void addResidualDelay(Result& result, const Estimate& whole, const Eigen::VectorXd& previous);

// "tau = ..." for a person.
inline constexpr std::string_view kDelayConvention =
    "tau = machine delay - probe delay; positive: the machine's stamps are late (M = P - tau v)";

}  // namespace probebox::metrology
