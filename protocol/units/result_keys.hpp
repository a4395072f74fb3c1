#pragma once
#include <string_view>

// Keys of those values of results that registers serve, or that rooms below that of their solver read. Methods promise
// them (firmware/metrology), blocks of registers show them (protocol/modbus); other keys stand beside the solver that
// gives them.
namespace probebox::result_key {

inline constexpr std::string_view kCentre = "centre_mm";
inline constexpr std::string_view kCentreX = "centre_x_mm";
inline constexpr std::string_view kCTilt = "C_tilt_rad";
inline constexpr std::string_view kCTiltX = "C_tilt_x_rad";
inline constexpr std::string_view kMeanHeight = "mean_z_mm";
inline constexpr std::string_view kOffsetCMinusA = "offset_C_minus_A_mm";
inline constexpr std::string_view kSpindleTilt = "A_tilt_rad";
inline constexpr std::string_view kPivotXz = "pivot_xz_mm", kPivotYz = "pivot_yz_mm", kPivotXy = "pivot_xy_mm";
inline constexpr std::string_view kLeanXz = "lean_xz_rad", kLeanYz = "lean_yz_rad", kLeanXy = "lean_xy_rad";
inline constexpr std::string_view kAlong = "along_mm";
inline constexpr std::string_view kSetter = "setter_mm";
inline constexpr std::string_view kLink = "link_mm";
inline constexpr std::string_view kVerdict = "verdict";
inline constexpr std::string_view kWorstRatio = "worst_ratio";
inline constexpr std::string_view kLocation = "location_mm";
inline constexpr std::string_view kTilt = "tilt_rad";
inline constexpr std::string_view kSixErrors = "six_errors";
inline constexpr std::string_view kSwivelTerms = "swivel_terms_mm", kLeftByAngle = "left_by_angle_mm";
inline constexpr std::string_view kScrewGain = "K";
inline constexpr std::string_view kColdReading = "reference_um";
inline constexpr std::string_view kPreTravel = "pre_travel_mm";
inline constexpr std::string_view kToolOffset = "tool_offset_mm";
// Of a lathe of X and Z, which tells nothing of Y.
inline constexpr std::string_view kToolOffsetX = "tool_offset_x_mm", kToolOffsetZ = "tool_offset_z_mm";
inline constexpr std::string_view kSetterX = "setter_x_mm", kSetterZ = "setter_z_mm", kLinkX = "link_x_mm";
inline constexpr std::string_view kCompensation = "compensation_mm";
inline constexpr std::string_view kAssembledLength = "assembled_length_mm", kGaugeLength = "gauge_length_mm";
inline constexpr std::string_view kStylusOffset = "stylus_offset_mm";
inline constexpr std::string_view kStylusOffsetX = "stylus_offset_x_mm", kStylusOffsetY = "stylus_offset_y_mm";

}  // namespace probebox::result_key
