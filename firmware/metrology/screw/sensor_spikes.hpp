#pragma once
#include <Eigen/Core>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A linear fit without its spikes, the rows in fit.dropped.
struct SpikeFreeFit {
  Fit fit;
  bool too_many{};  // more than single samples are: all rows are in use
};

// Fits as linearLeastSquares does and drops rows that are more than 4.5 deviations (and two digits of the values) off,
// of every group the worst at a time: a spike pulls the others of its group. group: of each row.
Outcome<SpikeFreeFit, Refusal> fitWithoutSpikes(const Eigen::MatrixXd& design, const Eigen::VectorXd& values,
                                                const std::vector<std::size_t>& group);

}  // namespace probebox::metrology
