#include "firmware/metrology/dataset/known_keys.hpp"

#include <algorithm>

namespace probebox::metrology {
namespace {

constexpr auto kKnown = std::to_array<KnownQuantity>({
    {"a-axis-alignment", "sd_C_tilt_rad", "C_tilt_rad", KnownKind::value},
    {"a-axis-alignment", "sd_ball_offset_mm", "ball_offset_mm", KnownKind::value},
    {"bore-fit", "sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"boss-fit", "sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"corner-fit", "sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"delay-feature", "sd_size_mm", "size_mm"},
    {"delay-feature", "sd_size_axis_mm", "size_axis_mm"},
    {"delay-joints", "sd_effective_diameter_mm", "effective_diameter_mm"},
    {"delay-known-sphere", "sd_effective_diameter_mm", "effective_diameter_mm"},
    {"delay-multi-speed", "sd_effective_diameter_mm", "effective_diameter_mm"},
    {"delay-non-normal", "sd_effective_diameter_mm", "effective_diameter_mm"},
    {"delay-per-axis", "sd_effective_diameter_mm", "effective_diameter_mm"},
    {"delay-plates", "sd_gap_mm", "gap_mm"},
    {"delay-plates", "sd_stylus_ball_diameter_mm", "stylus_ball_diameter_mm"},
    {"head-pivot", "sd_ball_mm", "ball_mm", KnownKind::value},
    {"head-pivot-3d", "sd_ball_mm", "ball_mm", KnownKind::value},
    {"pocket-fit", "sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"periodic-check", "sd_effective_ball_radius_mm", "effective_ball_radius_mm"},
    {"periodic-check", "sd_expected_ball_centre_z_mm", "expected_ball_centre_z_mm", KnownKind::value},
    {"rotary-axis-errors", "sd_certificate_mm", "third", KnownKind::table},
    {"screw-calibration", "sd_screw_length_mm", "screw_length_mm", KnownKind::value},
    {"screw-calibration", "sd_orgoff_mm", "orgoff_mm", KnownKind::value},
    {"screw-compensation", "sd_screw_length_mm", "screw_length_mm", KnownKind::value},
    {"screw-compensation", "sd_orgoff_mm", "orgoff_mm", KnownKind::value},
    {"screw-compensation", "sd_K", "K", KnownKind::value},
    {"screw-compensation", "sd_reference_um", "reference_um", KnownKind::value},
    {"sphere-fit", "sd_radius_mm", "radius_mm"},
    {"web-fit", "sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
    {"tool-assembly", "sd_L1_mm", "L1_mm", KnownKind::value, true},
    {"tool-assembly", "sd_L2_mm", "L2_mm", KnownKind::value, true},
    {"tool-assembly", "sd_part_mm", "part_mm", KnownKind::value, true},
    {"tool-setter", "sd_probe_offset_mm", "probe_offset_mm", KnownKind::value, true},
    {"tool-setter", "sd_probe_offset_mm", "probe_offsets", KnownKind::table, true},
    {"tool-setter", "sd_centreline_mm", "centreline_mm", KnownKind::value, true},
    {"tool-setter", "sd_C_tilt_rad", "C_tilt_rad", KnownKind::value, true},
});

}  // namespace

std::span<const KnownQuantity> knownQuantities() {
  return kKnown;
}

bool hasSize(std::string_view method) {
  return std::ranges::any_of(kKnown,
                             [&](const KnownQuantity& k) { return k.method == method && k.kind == KnownKind::size; });
}

std::vector<std::string_view> typeBKeys(std::string_view method) {
  std::vector<std::string_view> keys;
  for (const auto& known : kKnown) {
    if (known.method == method) keys.push_back(known.sd_key);
  }
  if (hasSize(method)) keys.insert(keys.end(), kTemperatureKeys.begin(), kTemperatureKeys.end());
  return keys;
}

bool isTypeBKey(std::string_view method, std::string_view key) {
  const auto keys = typeBKeys(method);
  return std::ranges::find(keys, key) != keys.end();
}

}  // namespace probebox::metrology
