#pragma once
#include <compare>

namespace probebox {

// Wraps a double with its unit. Quantities of different units do not mix; conversion from and to double is explicit.
// Solvers use raw doubles inside.
template <class Tag>
class Quantity {
 public:
  constexpr Quantity() = default;
  explicit constexpr Quantity(double value) : value_{value} {}

  constexpr double value() const { return value_; }

  constexpr Quantity& operator+=(Quantity other) { return value_ += other.value_, *this; }
  constexpr Quantity& operator-=(Quantity other) { return value_ -= other.value_, *this; }
  constexpr Quantity& operator*=(double factor) { return value_ *= factor, *this; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity{a.value_ + b.value_}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity{a.value_ - b.value_}; }
  friend constexpr Quantity operator-(Quantity a) { return Quantity{-a.value_}; }
  friend constexpr Quantity operator*(Quantity a, double factor) { return Quantity{a.value_ * factor}; }
  friend constexpr Quantity operator*(double factor, Quantity a) { return Quantity{a.value_ * factor}; }
  friend constexpr Quantity operator/(Quantity a, double divisor) { return Quantity{a.value_ / divisor}; }
  friend constexpr double operator/(Quantity a, Quantity b) { return a.value_ / b.value_; }
  friend constexpr auto operator<=>(Quantity, Quantity) = default;

 private:
  double value_{};
};

using Millimetres = Quantity<struct MillimetresTag>;
using Micrometres = Quantity<struct MicrometresTag>;
using MillimetresPerSecond = Quantity<struct MillimetresPerSecondTag>;
using Radians = Quantity<struct RadiansTag>;
using Kelvin = Quantity<struct KelvinTag>;
using Seconds = Quantity<struct SecondsTag>;

constexpr Micrometres toMicrometres(Millimetres length) {
  return Micrometres{length.value() * 1e3};
}
constexpr Millimetres toMillimetres(Micrometres length) {
  return Millimetres{length.value() * 1e-3};
}

}  // namespace probebox
