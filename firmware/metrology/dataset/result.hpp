#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/estimate.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Covariance of named components ("tau_s", "centre_mm[0]"), in the products of their units, in row order.
struct Covariance {
  std::vector<std::string> components;
  std::vector<double> values;
  friend bool operator==(const Covariance&, const Covariance&) = default;
};

// A reading that was not used, and the reason.
struct Dropped {
  std::string name;  // "touch 7", "point 3"
  std::string reason;
  friend bool operator==(const Dropped&, const Dropped&) = default;
};

// One line of an uncertainty budget: contribution of one cause to the standard uncertainty of every promised value.
struct Contribution {
  std::string name;        // "readings", "sd_effective_diameter_mm"
  bool type_b{};           // else type A: from the statistics of these readings
  std::vector<double> sd;  // k = 1, one per value, in the order of Result::estimates
  friend bool operator==(const Contribution&, const Contribution&) = default;
};

// A stated condition for a person: probe, machine, temperature.
struct Condition {
  std::string name;  // "temperature_c"
  std::string value;
  friend bool operator==(const Condition&, const Condition&) = default;
};

// Residuals of the readings (measured minus fitted), for a plot.
struct Residuals {
  std::string unit;                // of the values: "mm"
  std::string against;             // what `at` is: "C_rad"
  std::vector<std::string> names;  // "readings 3, x_mm"; "touch 7"
  std::vector<double> at;
  std::vector<double> values;
  friend bool operator==(const Residuals&, const Residuals&) = default;
};

// The worst-determined combination of the promised values: its coefficients for values in units of their sd. Its own sd
// is 1 for uncorrelated values, at most the square root of their number.
struct WorstDetermined {
  std::vector<std::string> components;
  std::vector<double> coefficients;  // unit length
  double sd{};
  friend bool operator==(const WorstDetermined&, const WorstDetermined&) = default;
};

// Result of every method.
struct Result {
  std::string method;
  std::vector<Estimate> estimates;  // the promised values
  std::vector<Estimate> also;       // further estimates: centre, gain matrix, speeds
  std::string convention;           // sign and sense of the estimates, where the field has more than one
  double rms{};        // of the readings that are used, in their unit (mm unless the method says otherwise)
  std::size_t dof{};   // degrees of freedom of the fit
  double condition{};  // condition number of the column-scaled Jacobian
  std::optional<double> chi2_reduced;
  std::optional<Covariance> covariance;
  std::vector<std::string> warnings;
  std::vector<Dropped> dropped;
  std::string design_per;                 // the reading whose sigma the design figures are per: "one coordinate, mm"
  std::vector<std::string> unobservable;  // quantities that such readings cannot determine, or that these do not
  std::optional<WorstDetermined> weakest;
  std::vector<Contribution> budget;
  Residuals residuals;
  Table touched;                      // touches that were used: t_s, x_mm, y_mm, z_mm, nx, ny, nz; for the budget alone
  std::vector<Condition> conditions;  // stated conditions of the measurement

  // Searches estimates, then also.
  const Estimate* find(std::string_view key) const;
  // Design figure of the first estimate: root mean square over its components.
  std::optional<double> designFigure() const;
  friend bool operator==(const Result&, const Result&) = default;
};

// Explains why there is no result. The name is stable, for programs; the reason is one sentence with the remedy, for a
// person.
struct Refusal {
  std::string name;  // "single-speed"
  std::string reason;
};

using Solved = Outcome<Result, Refusal>;

}  // namespace probebox::metrology
