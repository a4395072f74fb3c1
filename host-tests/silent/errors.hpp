#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

// Errors that every real machine or probe has, and slips of people, put into a simulated case.
namespace probebox::metrology::silent {

using Random = std::mt19937_64;

enum class Err : std::uint8_t {
  none,
  lost_motion,
  hysteresis,
  wrong_ball,
  drift,
  squareness,
  scale,
  lobing,
  curvature,
  vibration,
  uneven_screw,
  run_out,
  outlier,
  diameters,
  inches,
};

// What is put into one case.
struct Errors {
  std::vector<Err> kinds{};
  double size{1};  // times the ordinary one; slips have none
  bool states_noise{true};

  bool has(Err err) const { return std::ranges::find(kinds, err) != kinds.end(); }
};

struct ErrorKind {
  Err err{};
  std::string_view name;
  std::string_view size;
  std::vector<std::string> causes{};      // likely causes that are it, or leave the same readings
  std::vector<std::string_view> words{};  // whole words of other warnings and refusals that name it or these
};

// Err::none first.
std::span<const ErrorKind> errorKinds();

inline constexpr double kLost_mm = 0.005, kHysteresis_mm = 0.001, kBall_mm = 0.005, kDrift_mm_per_min = 5e-4,
                        kSquareness_rad = 50e-6, kScale = 20e-6, kLobing_mm = 0.003, kCurvature = 0.01,
                        kVibration_mm = 0.001, kRunOut_mm = 0.002;
inline constexpr double kNoise_mm = 5e-4;  // of a reading of a place, as it is stated
inline constexpr double kOutlier_mm = 100 * kNoise_mm, kInch_mm = 25.4;

// Places that were read, one a row.
struct PlacesRead {
  std::string table;
  std::array<std::string, 3> columns{"x_mm", "y_mm", "z_mm"};  // "" for none
  // Normal of a single contact; the centre of a ball, touched from four sides and from above, without it.
  std::function<Eigen::Vector3d(std::size_t row)> side{};
};

// Moves readings of places as a machine with these errors reads them, a minute apart, table after table; the machine is
// right at `about`, and at `right_at_min`. What stands on C runs out with C, where a table has its angle.
void disturb(Dataset& dataset, const std::vector<PlacesRead>& places, const Eigen::Vector3d& about,
             const Errors& errors, Random& random, double right_at_min = 0);

// Slips of a person who writes the readings down: one reading is off, X is in diameters, all are in inches.
void slip(Dataset& dataset, const std::vector<PlacesRead>& places, const Errors& errors, Random& random);

// The angle of C in a table; nullptr without one.
const Column* angleOfC(const Table& table);

// What a probe with three lobes reads too much on a side.
double lobe_mm(const Eigen::Vector3d& normal);

}  // namespace probebox::metrology::silent
