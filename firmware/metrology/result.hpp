#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::metrology {

enum class Shape { scalar, vector, matrix };

// One estimated quantity with its standard deviation (k = 1), in the unit that its key names ("tau_s", "centre_mm").
struct Estimate {
  std::string key;
  Shape shape{Shape::scalar};
  std::vector<double> values;  // a matrix row by row
  std::vector<double> sd;      // one a value; empty when neither a stated sigma nor a residual exists
  std::size_t columns{1};      // of a matrix

  static Estimate scalar(std::string key, double value, std::optional<double> sd);
  static Estimate vector(std::string key, std::vector<double> values, std::vector<double> sd);
  static Estimate matrix(std::string key, std::size_t columns, std::vector<double> values, std::vector<double> sd);

  // The value and sd of a scalar.
  double value() const { return values.front(); }
  std::optional<double> standardDeviation() const {
    return sd.empty() ? std::nullopt : std::optional<double>{sd.front()};
  }
};

// Covariance of named components ("tau_s", "centre_mm[0]"), in the products of their units, row by row.
struct Covariance {
  std::vector<std::string> components;
  std::vector<double> values;
};

// A reading that the estimate does not use, and why.
struct Dropped {
  std::string name;  // "touch 7", "point 3"
  std::string reason;
};

// What every method answers.
struct Result {
  std::string method;
  std::vector<Estimate> estimates;  // what the method promises
  std::vector<Estimate> also;       // what it found on the way: centre, gain matrix, speeds
  std::string convention;           // sign and sense of the estimates, where the field has more than one
  double rms{};        // of the residuals, in the unit of the readings (mm unless the method says otherwise)
  std::size_t dof{};   // degrees of freedom of the fit
  double condition{};  // of the column-scaled Jacobian
  std::optional<double> chi2_reduced;
  std::optional<Covariance> covariance;
  std::vector<std::string> warnings;
  std::vector<Dropped> dropped;

  // Looks through estimates, then also.
  const Estimate* find(std::string_view key) const;
};

// Why there is no number. The name is stable, for programs; the reason is one sentence with the remedy, for a person.
struct Refusal {
  std::string name;  // "single-speed"
  std::string reason;
};

}  // namespace probebox::metrology
