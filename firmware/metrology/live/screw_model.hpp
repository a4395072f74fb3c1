#pragma once
#include <array>
#include <cstddef>
#include <optional>

// Thermal extension of a ball screw: what it does at every reading (CN101394969, docs/metrology.md section D). Nothing
// here allocates, so the box calls the same functions at every tick as the off-line methods do.
namespace probebox::metrology {

inline constexpr std::size_t kMostSectors = 72;

// One ball screw: an axial bearing at one end, a floating one at the other, a sensor on the free end's face.
struct ScrewModel {
  double length_mm{};  // bearing to sensor face
  double offset_mm{};  // from the fixed bearing to the axis zero
  double gain{};       // K; -1 where the sensor sees it all and the correction is wanted, +1 for the error
  bool reversed{};  // the axis counts towards the fixed bearing: the distance is offset - position, and the sign turns
  double reference_um{};                         // reading of the sensor on the cold screw (D1a)
  std::array<double, kMostSectors> sector_um{};  // T: how far the face is off its mean plane, sector by sector
  std::size_t sector_count{};                    // 0: no table
  double threshold_rpm{};                        // above it the sensor averages over the face and the table is left out
};

// Distance of the nut from the fixed bearing, as a share of the screw's length, with the sign that `reversed` asks for.
double leverOf(const ScrewModel& screw, double position_mm);

// (D1): what an extension of the whole screw does to the nut at this position, um.
double compensationUm(const ScrewModel& screw, double position_mm, double extension_um);

// (D3): sector of `count` equal ones in which the screw stands; any angle, whole turns do not matter. count > 0.
std::size_t sectorAt(double angle_rad, std::size_t count);

// (D3): the face's error at this angle, um; 0 without a table.
double faceErrorUm(const ScrewModel& screw, double angle_rad);

// (D5) for a single reading: the table below the threshold, the bare sensor at and above it.
double extensionUm(const ScrewModel& screw, double angle_rad, double speed_rpm, double sensor_um);

// (D5): the speed at which the table starts to do harm, for the h-th harmonic of the face and a sensor of this time
// constant: 60 / (2 pi h Tf).
double thresholdRpm(unsigned harmonic, double time_constant_s);

// (D5) for a stream: how much of the table to take, from 1 below the threshold to 0 above it. It runs linearly over a
// band of 10 % to both sides, so that no speed makes the compensation jump by a whole sector. What `inUse` says has
// hysteresis: it turns at the far end of the band.
class TableShare {
 public:
  double at(double speed_rpm, double threshold_rpm);
  bool inUse() const { return in_use_; }

 private:
  bool in_use_{true};
};

// What an installation promises of a screw; a reading that breaks it is not believed.
struct ScrewLimits {
  double least_extension_um{};
  double greatest_extension_um{};
  double rate_um_s{};  // how fast the compensation may change; 0: no limit
};

// One stamped reading of a screw. sensor_um: nothing when the sensor is silent, faulty or stale.
struct ScrewReading {
  double position_mm{};
  double angle_rad{};
  double speed_rpm{};
  std::optional<double> sensor_um;
};

struct ScrewOutput {
  double compensation_um{};
  double extension_um{};  // of the screw, what its face added taken out; of the value that is held
  bool table_used{};
  bool held{};          // the last good value: the reading was not usable (D6)
  bool rate_limited{};  // the value is still on its way
};

// (D6): one output a cycle. A reading without a sensor, out of its limits or not finite holds the last value and says
// so; nothing is ever compensated with a stale reading.
class ScrewCompensator {
 public:
  ScrewCompensator(const ScrewModel& screw, const ScrewLimits& limits);

  // elapsed_s: since the last step, for the rate limit; it is not used on the first one.
  ScrewOutput step(const ScrewReading& reading, double elapsed_s);

 private:
  bool usable(const ScrewReading& reading, double extension_um) const;

  ScrewModel screw_;
  ScrewLimits limits_;
  TableShare share_;
  std::optional<double> last_um_;
  double extension_um_{};
};

}  // namespace probebox::metrology
