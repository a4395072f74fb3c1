#pragma once
#include <array>
#include <optional>
#include <string>

// machine.toml: what the integrator knows about the machine tool. Axes and signs as in ISO 841.
namespace probebox::board {

struct AxisDescription {
  double counts_per_mm{};  // of the encoder, positive
  int sense{1};            // +1 when counts rise in the positive direction of the axis, else -1
  double travel_min_mm{};
  double travel_max_mm{};

  // Limits of a correction in size and in rate of change; they take effect with the first source of corrections.
  double correction_limit_mm{};
  double correction_rate_mm_s{};
};

// How the control programs the X axis of a lathe; takes effect with the first source of corrections, which are in
// radius whatever stands here.
enum class Programming { radius, diameter };

struct Machine {
  std::string name;
  std::string mounting;                 // where the probe sits: a result holds for one mounting
  std::array<AxisDescription, 3> axes;  // X, Y, Z
  Programming x_programming{Programming::radius};
  // Features to calibrate on, as certified; nothing when there is none.
  std::optional<double> datum_sphere_diameter_mm;
  std::optional<double> datum_gap_mm;  // between two parallel plates across X
  double sigma_c_rad{};                // how exactly the rotary axis C finds an angle (k = 1)
  double hold_s{};  // how long a doubtful source is to be held; takes effect with the first source of corrections
};

}  // namespace probebox::board
