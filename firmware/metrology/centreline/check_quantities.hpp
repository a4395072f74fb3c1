#pragma once
#include <array>
#include <string_view>

#include "firmware/metrology/dataset/column.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "protocol/units/result_keys.hpp"

// Quantities of the periodic check: the mean values that it measures and compares with accepted ones.
namespace probebox::metrology {

// One mean: which readings make it, and what cancels in it.
struct CheckQuantity {
  std::string_view key;
  std::string_view table;
  std::string_view column;
  double swivel{};  // degrees
  bool ball{};      // the ball's run-out cancels between C = 0 and 180
  bool stylus{};    // the stylus' run-out cancels between spindle 0 and 180
  bool promised{true};
};

// Run-outs of ball and stylus at B = 0; the check asks for a new calibration when they have changed.
inline constexpr std::array<std::string_view, 4> kCheckRunOuts{"ball_offset_x_mm", "ball_offset_y_mm",
                                                               result_key::kStylusOffsetX, result_key::kStylusOffsetY};

inline constexpr CheckQuantity kXAtLevel{"Xcen_B0_mm", "centres", column::kX, 0.0, true, true};
inline constexpr CheckQuantity kYAtLevel{"Ycen_B0_mm", "centres", column::kY, 0.0, true, true};
inline constexpr CheckQuantity kZAtLevel{"z_offset_error_mm", "z_touch", column::kZ, 0.0, false, false};
inline constexpr CheckQuantity kYAt45{"Ycen_B45_mm", "centres", column::kY, 45.0, true, true};
inline constexpr CheckQuantity kYAt90{"Ycen_B90_mm", "centres", column::kY, 90.0, true, true};
inline constexpr CheckQuantity kZAt90{"Zcen_B90_mm", "centres", column::kZ, 90.0, true, true, false};
inline constexpr CheckQuantity kXAt90{"x_offset_error_mm", "x_touch", column::kX, 90.0, true, false};

namespace quantity {
// Of the checked ball at C = 0 and B = 0, from which the next check starts.
inline constexpr Quantity kBallCentre{.key = "ball_centre_mm"};
// The same of a lathe of X and Z, whose Y nothing tells.
inline constexpr Quantity kBallCentreZ{.key = "ball_centre_z_mm"};
}  // namespace quantity

// In the order of the answer: by angle of the head.
inline constexpr std::array kCheckQuantities{&kXAtLevel, &kYAtLevel, &kZAtLevel, &kYAt45, &kYAt90, &kZAt90, &kXAt90};

}  // namespace probebox::metrology
