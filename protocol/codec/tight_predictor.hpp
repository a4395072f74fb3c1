#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

// Predicts the next value of a channel from all before it. Double precision without fused operations, in a fixed order
// and with nothing but + - * / and the square root, which IEEE 754 defines to the last bit: every machine predicts
// the same.
namespace probebox::codec {

class TightPredictor {
 public:
  // The next value is about whole + fraction, modulo 2^64.
  struct Expected {
    std::int64_t whole{};
    double fraction{};  // 0 to 1
    double sd{};        // of the residual, at least kLeastSd
    bool has_sd{};      // false for the first values
  };
  static constexpr double kLeastSd = 0.05;

  Expected expected();
  // Takes the value that expected() was about.
  void learn(std::int64_t value);

 private:
  static constexpr std::size_t kFilters = 7;
  static constexpr std::size_t kPast = 10;
  static constexpr std::size_t kInputs = kFilters - 1 + kPast;
  static constexpr std::size_t kCoefficients = 4;  // of a polynomial, up to degree 3
  using Inputs = std::array<double, kInputs>;
  using Coefficients = std::array<double, kCoefficients>;

  static Coefficients gains(std::size_t filter, double samples);
  void beginMixing();
  void mix(double error);
  void follow(double step, bool is_jump);
  void scale(double residual, bool is_jump);
  void forget();

  std::int64_t last_{};
  std::uint32_t samples_{};
  std::uint32_t jumps_{};  // in succession
  double variance_{};
  double expected_{};  // relative to the last value, as the filters are
  double mixed_{};     // of it, what the mixer adds to the first filter
  // Polynomials that follow the channel with fading memory: what each expects for the next sample.
  std::array<Coefficients, kFilters> filters_{};
  std::array<Coefficients, kFilters> gains_{};
  // The mixer: recursive least squares on how the other filters differ from the first one and on the first one's last
  // errors.
  Inputs inputs_{};
  Inputs weights_{};
  std::array<Inputs, kInputs> covariance_{};
};

}  // namespace probebox::codec
