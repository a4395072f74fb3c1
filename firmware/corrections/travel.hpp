#pragma once

namespace probebox::corrections {

// Machine positions that an axis reaches, mm; not described where both are equal.
struct Travel {
  // Margin for the rounding of positions: registers have steps of 0.1 um, float32 0.03 um at 400 mm.
  static constexpr double kRounding_mm = 0.001;

  double min_mm{}, max_mm{};

  bool isDescribed() const { return max_mm > min_mm; }
  // False for NaN.
  bool reaches(double position_mm) const {
    return position_mm >= min_mm - kRounding_mm && position_mm <= max_mm + kRounding_mm;
  }
};

}  // namespace probebox::corrections
