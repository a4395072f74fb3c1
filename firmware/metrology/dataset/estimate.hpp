#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::metrology {

enum class Shape { scalar, vector, matrix };

// One estimated quantity with its standard deviation (k = 1), in the unit named by its key ("tau_s", "centre_mm").
struct Estimate {
  std::string key;
  Shape shape{Shape::scalar};
  std::vector<double> values;  // a matrix in row order
  std::vector<double> sd;      // one a value; empty when neither a stated sigma nor a residual exists
  std::size_t columns{1};      // of a matrix
  // sd of each value per unit sigma of one reading: the geometry's contribution, independent of the noise. Empty if
  // undefined. Unit: that of the value per that of the reading (Result::design_per).
  std::vector<double> design{};
  // Change of each value, a row each, when one touch of Result::touched lies 1 mm further along its normal. Empty
  // of a value that does not rest on these.
  std::vector<double> per_shift{};
  // Combined standard uncertainty of each value, type A and B (k = 1); equal to sd without type B inputs. U = 2 * this.
  std::vector<double> uncertainty{};

  static Estimate scalar(std::string_view key, double value, std::optional<double> sd);
  static Estimate vector(std::string_view key, std::vector<double> values, std::vector<double> sd);
  static Estimate matrix(std::string_view key, std::size_t columns, std::vector<double> values, std::vector<double> sd);

  // Value and sd of a scalar.
  double value() const { return values.front(); }
  std::optional<double> standardDeviation() const {
    return sd.empty() ? std::nullopt : std::optional<double>{sd.front()};
  }
  friend bool operator==(const Estimate&, const Estimate&) = default;
};

// Values of an estimate that share a unit: their indices, and a key that names the unit.
struct EstimatePart {
  std::string key;
  std::vector<std::size_t> at;
};

// The whole estimate; for "six_errors", whose rows hold three lengths and three angles, "translations_mm" and
// "rotations_rad".
std::vector<EstimatePart> partsOf(const Estimate& estimate);

}  // namespace probebox::metrology
