#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace probebox::support {

// Reference record for codecs: a scan of a sphere at constant speed, as integers. The probe's deflection points along
// the normal of the surface; the positions contain ripple of the servo and noise of the encoders. Columns: sample,
// time, three deflections, three linear and two rotary encoders, flags: 58 bytes as a packed structure.
struct ScanSignal {
  double rate_hz{4000};
  double speed_mm_s{250};  // 15 m/min
  double radius_mm{17.5};  // of the path of the stylus ball's centre
  double deflection_um{300};
  double deflection_noise_nm{30};
  double encoder_noise_nm{6.5};
  double ripple_nm{60};  // of the servo, at ripple_hz
  double ripple_hz{37};
  double rotary_noise_counts{0.4};  // held axes

  static constexpr std::size_t kColumns = 9;  // as streamed: index and time are in the block's header
  static constexpr std::array<std::uint8_t, kColumns> kBytes{4, 4, 4, 8, 8, 8, 4, 4, 2};
  static constexpr std::size_t kRecordBytes = 58;

  // Column by column, `count` each.
  std::vector<std::int64_t> columns(std::size_t count, std::uint64_t seed) const {
    constexpr double kTau = 6.283185307179586;
    std::mt19937_64 random{seed};
    std::normal_distribution<double> unit{0, 1};
    std::vector<std::int64_t> made(kColumns * count);
    const double climb_per_s = 0.02;  // rad of latitude
    double longitude = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double t = static_cast<double>(k) / rate_hz;
      const double latitude = 0.9 * std::sin(climb_per_s * t);
      longitude += speed_mm_s / (radius_mm * std::cos(latitude)) / rate_hz;
      const std::array<double, 3> normal{std::cos(latitude) * std::cos(longitude),
                                         std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double phase = kTau * ripple_hz * (1 + 0.1 * static_cast<double>(axis)) * t;
        const double ripple = ripple_nm * std::sin(phase);
        const auto at = [&](std::size_t column) -> std::int64_t& { return made[column * count + k]; };
        at(axis) = std::llround(1e3 * deflection_um * normal[axis] + ripple + deflection_noise_nm * unit(random));
        at(3 + axis) = std::llround(1e6 * (200 + radius_mm * normal[axis]) + ripple + encoder_noise_nm * unit(random));
      }
      for (std::size_t rotary = 0; rotary < 2; ++rotary)
        made[(6 + rotary) * count + k] = 1'234'567 + std::llround(rotary_noise_counts * unit(random));
      made[8 * count + k] = 4;  // touching
    }
    return made;
  }
};

}  // namespace probebox::support
