#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// An R-test sensor head: three displacement sensors on the spindle that measure one ball from different sides. Reading
// = zero + matrix * (position of the ball relative to the head's reference, mm) (CN112247668, docs/metrology.md (E1)).
struct SensorHead {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  // K, in units of the sensors per mm; one row per sensor
  Eigen::Vector3d zero = Eigen::Vector3d::Zero();

  // Position of the ball relative to the reference, mm.
  Eigen::Vector3d displacement(const Eigen::Vector3d& sensors) const;
  // Position of the ball in the machine, mm: machine position, tool vector and displacement.
  Eigen::Vector3d ball(const Eigen::Vector3d& machine, const Eigen::Vector3d& tool,
                       const Eigen::Vector3d& sensors) const;
};

// Method "sensor-head-calibration": the head's matrix from small moves of the machine beside a fixed ball ((E1)). Table
// moves{ux_mm,uy_mm,uz_mm,s1,s2,s3}: ball relative to the reference (minus the machine's move), and sensor readings.
// Optional table readings{x_mm,y_mm,z_mm,s1,s2,s3}: machine positions and sensor readings. Config: sigma_sensor, of one
// sensor, in its unit; tool_vector_mm. Gives sensor_matrix and sensor_zero; with readings also ball_mm, one row per
// reading. Also sensitivity of each sensor, in units per mm, and with reference_mm (the machine's position at the
// reference) centred_mm, the machine position at which all sensors read zero. Refuses:
// bad-config, dependent-directions (moves along fewer than three axes), moves-too-small (under five times the noise),
// what linearLeastSquares refuses, sensors-dependent (condition of K above 50), and implausible (a ball beyond 20 mm).
// Warns of a ball beyond 1.5 times the largest move.
Outcome<Result, Refusal> solveSensorHeadCalibration(const Dataset& dataset);

namespace quantity {

inline std::string sensorPart(std::size_t component) {
  return component < 9 ? "sensor " + std::to_string(component / 3 + 1) + " per " + axisName(component % 3)
                       : std::string{};
}

inline constexpr std::string_view kSensorRows[]{"sensor 1", "sensor 2", "sensor 3"};
inline constexpr QuantityColumn kSensorColumns[]{{"X", ""}, {"Y", ""}, {"Z", ""}};
inline constexpr Quantity kSensorMatrix{.key = "sensor_matrix",
                                        .about = "units of the sensors per mm, one row per sensor",
                                        .part_name = sensorPart,
                                        .rows = kSensorRows,
                                        .columns = kSensorColumns};
inline constexpr Quantity kSensorZero{.key = "sensor_zero", .about = "reading of each sensor at the reference"};

}  // namespace quantity

extern const Method kSensorHeadCalibration;

}  // namespace probebox::metrology
