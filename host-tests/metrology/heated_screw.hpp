#pragma once
#include <array>
#include <cmath>
#include <complex>
#include <random>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A ball screw that is heated, turned and read by a sensor at its end.
namespace probebox::metrology {

// A screw whose temperature rises by some degrees everywhere, and whose end face is not plane.
struct Screw {
  double length_mm{820.0};
  double offset_mm{60.0};
  double sensor_share{0.93};  // how much of the true extension the sensor misses: the gain is its inverse
  std::array<std::complex<double>, 2> face{std::polar(3.0, -0.4), std::polar(0.8, -1.9)};  // um, harmonics 1 and 2
  std::size_t sectors{24};

  double waviness(double angle) const {
    return (face[0] * std::polar(1.0, angle) + face[1] * std::polar(1.0, 2.0 * angle)).real();
  }
  // Mean of the waviness over a sector, summed finely.
  double sectorMean(std::size_t sector) const {
    constexpr int kSteps = 4000;
    double sum = 0.0;
    for (int k = 0; k < kSteps; ++k) {
      sum += waviness(kTurn * (static_cast<double>(sector) + (k + 0.5) / kSteps) / static_cast<double>(sectors));
    }
    return sum / kSteps;
  }
  // Shift of the nut: expansion summed piece by piece from the fixed bearing.
  double nutShiftUm(double position_mm, double kelvin) const {
    constexpr int kPieces = 500;
    double shift = 0.0;
    for (int k = 0; k < kPieces; ++k) shift += 11.5e-6 * kelvin * (position_mm + offset_mm) / kPieces * 1e3;
    return shift;
  }
  double sensorUm(double kelvin) const { return 11.5e-6 * kelvin * length_mm * 1e3 * sensor_share; }
};

inline Screw randomScrew(std::mt19937_64& random) {
  return {.length_mm = uniform(random, 400, 1500),
          .offset_mm = uniform(random, 20, 120),
          .sensor_share = uniform(random, 0.8, 1.2),
          .face = {std::polar(uniform(random, 0.5, 4), uniform(random, -3, 3)),
                   std::polar(uniform(random, 0.1, 1), uniform(random, -3, 3))},
          .sectors = std::uniform_int_distribution<std::size_t>{6, 24}(random)};
}

struct Rotation {
  double period_s{10.0};
  double rate_hz{60.0};
  double seconds{60.0};
  double sigma_um{0.2};
  double drift_um_s{0.002};
  double bend_um_s2{0};  // of the drift, about the mean time
};

inline Dataset calibration(const Screw& screw, const Rotation& rotation, double sigma_error_um,
                           std::mt19937_64& random) {
  Dataset dataset{.method = "screw-calibration",
                  .config = {{"screw_length_mm", screw.length_mm},
                             {"orgoff_mm", screw.offset_mm},
                             {"sectors", static_cast<double>(screw.sectors)}},
                  .tables = {}};
  Table gain = Table::withColumns("gain_cal", std::array<std::string_view, 3>{"x_mm", "ext_um", "error_um"});
  for (const double kelvin : {1.0, 2.5, 4.0, 5.5}) {
    for (const double share : {0.0, 0.3, 0.6, 0.85}) {
      const double x = share * screw.length_mm - 0.5 * screw.offset_mm;
      gain.append({x, screw.sensorUm(kelvin), screw.nutShiftUm(x, kelvin) + gauss(random, sigma_error_um)});
    }
  }
  Table face = Table::withColumns("sector_cal", std::array<std::string_view, 3>{"t_s", "phi_rad", "sensor_um"});
  const int samples = static_cast<int>(rotation.seconds * rotation.rate_hz);
  for (int k = 0; k < samples; ++k) {
    const double t = k / rotation.rate_hz;
    const double angle = kTurn * t / rotation.period_s + 0.3;
    face.append({t, std::fmod(angle, kTurn),
                 12.0 + rotation.drift_um_s * t + rotation.bend_um_s2 * std::pow(t - rotation.seconds / 2, 2) +
                     screw.waviness(angle) + gauss(random, rotation.sigma_um)});
  }
  dataset.tables = {std::move(gain), std::move(face)};
  return dataset;
}

}  // namespace probebox::metrology
