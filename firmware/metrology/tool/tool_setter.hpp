#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "tool-setter": offsets of a tool from a setting device that the calibrated probe has measured at the same B
// and on the same faces (CN101976057, docs/metrology.md B.9, (B22)). Table readings{is_tool,x_mm,y_mm,z_mm}: machine
// positions at the device's centre, half widths and radii taken off, except that stylus_ball_radius_mm is still in z_mm
// of the probe. Config: probe_offset_mm (of the probe's tip from the head's reference), sd_probe_offset_mm, sigma_mm;
// accepted_setter_mm and setter_limit_mm to notice a moved device.
// Instead of readings table touches{is_tool,nx,ny,nz,half_width_mm,radius_mm,x_mm,y_mm,z_mm}: positions at contact with
// one face each, from which its half width and the radius of what touched it are taken off along its normal (B22a);
// stylus_ball_radius_mm comes on top of radius_mm where the probe touched. A turning tool touches one face an axis.
// With centreline_mm (x and y at centreline_z_mm), C_tilt_rad, sd_centreline_mm, sd_C_tilt_rad also the link of the
// device to the turning axis at the device's Z (B22b); accepted_link_mm with setter_limit_mm notices that it changed.
// Several B in one case (B22c): a column B_deg, and table probe_offsets{B_deg,x_mm,y_mm,z_mm} in the place of
// probe_offset_mm; every value then is a matrix, a row each B in rising order, as accepted values have to be.
// Gives tool_offset_mm, setter_mm and, with a centreline, link_mm. With machine_axes "XZ", of a lathe, touches at
// one B have no face along Y, and it gives tool_offset_x_mm, tool_offset_z_mm, setter_x_mm, setter_z_mm and link_x_mm,
// where Y counts as 0. Refuses: missing-key, bad-config, bad-flag, probe-not-measured, tool-not-measured, setter-moved;
// of touches bad-direction, faces-differ, missing-face; of several B duplicated-angle, missing-orientation (a B without
// probe offset), too-many-angles (20).
Outcome<Result, Refusal> solveToolSetter(const Dataset& dataset);

namespace quantity {

// Wide: a tool of a small machine is 30 mm long from its gauge line, and one of 7.9 mm is 200 mm in inches.
inline constexpr Quantity kToolOffset{.key = result_key::kToolOffset,
                                      .about = "tool tip from the head's reference, x y z; one row per B",
                                      .axes = "XYZ",
                                      .usual = {.least_mm = 20, .most_mm = 2000}};
inline constexpr Quantity kSetter{
    .key = result_key::kSetter, .about = "position of the device, x y z; one row per B", .axes = "XYZ"};
inline constexpr Quantity kLink{
    .key = result_key::kLink,
    .about = "position of the device relative to the turning axis, x y; needs centreline_mm; one row per B",
    .axes = "XY"};
inline constexpr Quantity kToolOffsetX{
    .key = result_key::kToolOffsetX,
    .about = "tool tip from the head's reference along X, in radius; no touch along Y",
    .axes = "X"};
inline constexpr Quantity kToolOffsetZ{.key = result_key::kToolOffsetZ,
                                       .about = "the same along Z",
                                       .axes = "Z",
                                       .usual = {.least_mm = 20, .most_mm = 2000}};
inline constexpr Quantity kSetterX{
    .key = result_key::kSetterX, .about = "position of the device along X; no touch along Y", .axes = "X"};
inline constexpr Quantity kSetterZ{.key = result_key::kSetterZ, .about = "the same along Z", .axes = "Z"};
inline constexpr Quantity kLinkX{
    .key = result_key::kLinkX, .about = "X of the device from the turning axis; needs centreline_mm", .axes = "X"};

}  // namespace quantity

extern const Method kToolSetter;

}  // namespace probebox::metrology
