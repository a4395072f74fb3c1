#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "protocol/units/ball_screw.hpp"

// Evaluates the thermal extension of a ball screw at every reading (CN101394969, docs/metrology.md section D). Nothing
// allocates; box and off-line methods call the same functions.
namespace probebox::metrology {

inline constexpr std::size_t kMostSectors = 72;

// One ball screw, with the meaning of its extension.
struct ScrewModel : BallScrew {
  double gain{};          // K of (D1): -1 (correction) or +1 (error) if the sensor measures the whole extension
  double reference_um{};  // reading of the sensor on the cold screw (D1a)
  std::array<double, kMostSectors> sector_um{};  // T: deviation of the face from its mean plane, mean of a sector
  std::size_t sector_count{};                    // 0: no table
  double threshold_rpm{};  // above it the sensor averages over the face, and the table is not used
};

// Distance of the nut from the fixed bearing as a fraction of the screw's length, signed by `reversed`.
double leverOf(const ScrewModel& screw, double position_mm);

// (D1): displacement of the nut at this position by an extension of the whole screw, um.
double compensationUm(const ScrewModel& screw, double position_mm, double extension_um);

// (D3): sector of `count` equal ones at this angle; whole turns are ignored. count > 0.
std::size_t sectorAt(double angle_rad, std::size_t count);

// (D3): error of the face at this angle, um, on the line between the middles of two sectors; 0 without a table.
double faceErrorUm(const ScrewModel& screw, double angle_rad);

// (D5) for a single reading: with the table below the threshold speed, without it above.
double extensionUm(const ScrewModel& screw, double angle_rad, double speed_rpm, double sensor_um);

// (D5): speed, rpm, above which the table increases the error, for the h-th harmonic of the face and this time constant
// Tf of the sensor: 60 / (2 pi h Tf).
double thresholdRpm(unsigned harmonic, double time_constant_s);

// (D5) for a stream: weight of the table, from 1 below the threshold to 0 above it, linear over +-10 %, so the
// compensation never jumps by a whole sector. `inUse` has hysteresis: it changes at the far end of the band.
class TableShare {
 public:
  double at(double speed_rpm, double threshold_rpm);
  bool inUse() const { return in_use_; }

 private:
  bool in_use_{true};
};

// Limits of plausible readings.
struct ScrewLimits {
  double least_extension_um{};
  double greatest_extension_um{};
  // Maximum rate of the extension that is used; 0: no limit. It does not limit changes of the compensation with the
  // position, because a traversing axis is at once at another place of a warm screw.
  double rate_um_s{};
};

// One stamped reading of a screw. sensor_um: nullopt when the sensor is silent, faulty or stale.
struct ScrewReading {
  double position_mm{};
  double angle_rad{};
  double speed_rpm{};
  std::optional<double> sensor_um;
};

struct ScrewOutput {
  double compensation_um{};
  double extension_um{};  // extension of the screw without the face error; of the held value
  bool table_used{};
  bool held{};          // the last good value: the reading was not usable (D6)
  bool rate_limited{};  // the extension that is used lags behind the readings
};

// (D6): one output per cycle. A missing, implausible or non-finite reading holds the last value and reports it; stale
// readings are never used.
class ScrewCompensator {
 public:
  ScrewCompensator(const ScrewModel& screw, const ScrewLimits& limits);

  // elapsed_s: since the last step that was not held, for the rate limit; ignored on the first one.
  ScrewOutput step(const ScrewReading& reading, double elapsed_s);

 private:
  bool usable(const ScrewReading& reading, double extension_um) const;

  ScrewModel screw_;
  ScrewLimits limits_;
  TableShare share_;
  std::optional<double> last_um_;  // compensation
  std::optional<double> used_um_;  // extension
  double extension_um_{};
};

}  // namespace probebox::metrology
