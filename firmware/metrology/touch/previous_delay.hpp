#pragma once
#include <Eigen/Core>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The delay, s, by which the machine's stamps were corrected before recording: the measured delay is then the residual,
// and the whole delay is their sum (CN101622513, docs/metrology.md A.9).

// "previous_tau_s", or "previous_tau_axis_s" for x, y and z.
std::string_view previousDelayKey(Eigen::Index count);

// Reads it: a number for "previous_tau_s", otherwise a list; zeros when the key is absent. Refuses: bad-config.
Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, std::string_view key, Eigen::Index count);
Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, Eigen::Index count);

// Adds the residual delay to a result if there was a previous delay.
void addResidualDelay(Result& result, const Estimate& whole, const Eigen::VectorXd& previous);

// "tau = ..." for a person.
inline constexpr std::string_view kDelayConvention =
    "tau = machine delay - probe delay; positive: the machine's stamps are late (M = P - tau v)";

}  // namespace probebox::metrology
