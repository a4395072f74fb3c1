#include "tools/case/budget_names.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "firmware/metrology/dataset/stop_shifts.hpp"

namespace probebox::casefolder {
namespace {

using Named = std::pair<std::string_view, std::string_view>;

constexpr auto kKeys = std::to_array<Named>({
    {"sd_effective_diameter_mm", "certificate of the sphere"},
    {"sd_stylus_ball_diameter_mm", "stylus ball"},
    {"sd_stylus_ball_radius_mm", "stylus ball"},
    {"sd_temperature_k", "temperature of the sphere"},
    {"sd_expansion_per_k", "expansion of the sphere"},
    {"sd_radius_mm", "certificate of the sphere"},
    {"sd_size_mm", "certificate of the feature"},
    {"sd_size_axis_mm", "certificate of the feature"},
    {"sd_gap_mm", "certificate of the gap"},
    {"sd_lost_motion_mm", "lost motion of the axes"},
    {"sd_certificate_mm", "certificate of the ball plate"},
    {"sd_effective_ball_radius_mm", "radius of the checked ball"},
    {"sd_expected_ball_centre_z_mm", "accepted height of the checked ball"},
    {"sd_ball_mm", "position of the datum sphere"},
    {"sd_ball_offset_mm", "second ball of the holder"},
    {"sd_C_tilt_rad", "tilt of C"},
    {"sd_centreline_mm", "turning axis"},
    {"sd_probe_offset_mm", "offset of the probe"},
    {"sd_half_width_mm", "half width of the setting device"},
    {"sd_L1_mm", "stored length of the holder"},
    {"sd_L2_mm", "stored length of the tool"},
    {"sd_part_mm", "position of the measuring unit"},
    {"sd_screw_length_mm", "length of the screw"},
    {"sd_orgoff_mm", "distance of the fixed bearing"},
    {"sd_K", "gain of the screw"},
    {"sd_reference_um", "reading of the cold screw"},
    {"sd_pre_travel_mm", "pre-travel of the probe"},
    {"sd_length_1_mm", "length of the first tool"},
    {"sd_length_2_mm", "length of the second tool"},
    {"sd_length_3_mm", "length of the third tool"},
    {"sd_length_4_mm", "length of the fourth tool"},
});
constexpr auto kCauses = std::to_array<Named>({
    {metrology::kTableStands.budget, "stop of the tilting table"},
    {metrology::kHeadStands.budget, "stop of the swivelling head"},
});

}  // namespace

std::string budgetName(std::string_view name) {
  const auto key = name.substr(0, name.find('['));  // a part of several
  if (const auto found = std::ranges::find(kKeys, key, &Named::first); found != kKeys.end())
    return std::string{found->second} + " (" + std::string{name} + ")";
  const auto cause = std::ranges::find(kCauses, name, &Named::first);
  return std::string{cause == kCauses.end() ? name : cause->second};
}

std::string keyInWords(std::string key) {
  std::ranges::replace(key, '_', ' ');
  for (std::size_t k = 0; k < key.size(); ++k) {
    const bool alone = (k == 0 || key[k - 1] == ' ') && (k + 1 == key.size() || key[k + 1] == ' ');
    if (alone && key[k] >= 'x' && key[k] <= 'z') key[k] = static_cast<char>(key[k] - 'x' + 'X');
  }
  return key;
}

}  // namespace probebox::casefolder
