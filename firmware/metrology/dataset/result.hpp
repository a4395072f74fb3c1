#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/estimate.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Covariance of named components ("tau_s", "centre_mm[0]"), in the products of their units, row by row.
struct Covariance {
  std::vector<std::string> components;
  std::vector<double> values;
  friend bool operator==(const Covariance&, const Covariance&) = default;
};

// A reading that the estimate does not use, and why.
struct Dropped {
  std::string name;  // "touch 7", "point 3"
  std::string reason;
  friend bool operator==(const Dropped&, const Dropped&) = default;
};

// One line of an uncertainty budget: what one cause adds to the standard uncertainty of every promised value.
struct Contribution {
  std::string name;        // "readings", "sd_effective_diameter_mm"
  bool type_b{};           // else type A: from the statistics of these readings
  std::vector<double> sd;  // k = 1, value by value, in the order of Result::estimates
  friend bool operator==(const Contribution&, const Contribution&) = default;
};

// Something that the case states for the record, as a person reads it: probe, machine, temperature.
struct Condition {
  std::string name;  // "temperature_c"
  std::string value;
  friend bool operator==(const Condition&, const Condition&) = default;
};

// What is left of the readings after the fit, read minus fitted, for a picture.
struct Residuals {
  std::string unit;                // of the values: "mm"
  std::string against;             // what `at` is: "C_rad"
  std::vector<std::string> names;  // "readings 3, x_mm"; "touch 7"
  std::vector<double> at;
  std::vector<double> values;
  friend bool operator==(const Residuals&, const Residuals&) = default;
};

// The combination of promised values that the readings determine worst: values in their own sd, times these
// coefficients. Its sd is 1 where nothing is correlated, and the root of the number of values at worst.
struct Weakest {
  std::vector<std::string> components;
  std::vector<double> coefficients;  // unit length
  double sd{};
  friend bool operator==(const Weakest&, const Weakest&) = default;
};

// What every method answers.
struct Result {
  std::string method;
  std::vector<Estimate> estimates;  // what the method promises
  std::vector<Estimate> also;       // what it found on the way: centre, gain matrix, speeds
  std::string convention;           // sign and sense of the estimates, where the field has more than one
  double rms{};        // of the readings that are used, in their unit (mm unless the method says otherwise)
  std::size_t dof{};   // degrees of freedom of the fit
  double condition{};  // of the column-scaled Jacobian
  std::optional<double> chi2_reduced;
  std::optional<Covariance> covariance;
  std::vector<std::string> warnings;
  std::vector<Dropped> dropped;
  std::string design_per;                 // the reading whose sigma the design figures are per: "one coordinate, mm"
  std::vector<std::string> unobservable;  // what no number of such readings can tell, or what these ones do not
  std::optional<Weakest> weakest;
  std::vector<Contribution> budget;
  Residuals residuals;
  std::vector<Condition> conditions;  // under which it was measured, as far as the case states them

  // Looks through estimates, then also.
  const Estimate* find(std::string_view key) const;
  // The design figure in one number: of the first estimate, root mean square over its components.
  std::optional<double> designFigure() const;
  friend bool operator==(const Result&, const Result&) = default;
};

// Why there is no number. The name is stable, for programs; the reason is one sentence with the remedy, for a person.
struct Refusal {
  std::string name;  // "single-speed"
  std::string reason;
};

using Solved = Outcome<Result, Refusal>;

}  // namespace probebox::metrology
