#include "firmware/procedure/methods/plate_tables.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "firmware/procedure/methods/plate_poses.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 6> kColumnsOfPlateTables{"phi_rad", "mount", "ball", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 5> kColumnsOfOneMount{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
// More than what B stands beside zero.
constexpr double kLeastTilt_rad = 0.01;

// Along an axis of the machine. What the delay does to the top of a ball it does at every stop of C alike, and the
// plate's place takes it along.
double alongSigmaOf(const std::vector<Reading>& readings, const Eigen::Vector3d& axis) {
  double sum = 0;
  for (const auto& reading : readings) sum += reading.centre.sd_mm.cwiseProduct(axis).squaredNorm();
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// One figure for both coordinates across it.
double acrossSigmaOf(const std::vector<Reading>& readings, const Eigen::Vector3d& axis) {
  double sum = 0;
  for (const auto& reading : readings)
    sum += (reading.centre.sd_mm.squaredNorm() - reading.centre.sd_mm.cwiseProduct(axis).squaredNorm()) / 2;
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// Angles of the stops as reported. In one mount the axis stands clamped at a stop: its first report counts.
class StopAngles {
 public:
  void add(std::uint16_t mount, std::uint16_t stop, double angle_rad) { reported_[stop].try_emplace(mount, angle_rad); }

  // From where the mount began.
  double turned(std::uint16_t mount, std::uint16_t stop) const {
    const auto began = reported_.find(0);
    const double from_rad = began != reported_.end() && began->second.contains(mount) ? began->second.at(mount) : 0;
    return reported_.at(stop).at(mount) - from_rad;
  }

  // The same for all mounts: their mean.
  double phi(std::uint16_t stop) const {
    double sum = 0;
    for (const auto& [mount, angle] : reported_.at(stop)) sum += besideFirst(mount, stop);
    return turned(firstMount(stop), stop) + sum / static_cast<double>(reported_.at(stop).size());
  }

  // The largest difference between two mounts at one stop.
  double widest() const {
    double widest = 0;
    for (const auto& [stop, mounts] : reported_) {
      double least = 0, greatest = 0;
      for (const auto& [mount, angle] : mounts) {
        least = std::min(least, besideFirst(mount, stop));
        greatest = std::max(greatest, besideFirst(mount, stop));
      }
      widest = std::max(widest, greatest - least);
    }
    return widest;
  }

 private:
  std::uint16_t firstMount(std::uint16_t stop) const { return reported_.at(stop).begin()->first; }
  double besideFirst(std::uint16_t mount, std::uint16_t stop) const {
    return std::remainder(turned(mount, stop) - turned(firstMount(stop), stop), kTurn);
  }

  std::map<std::uint16_t, std::map<std::uint16_t, double>> reported_;  // by stop and mount
};

// The nominal axis.
struct PlateAxis {
  Eigen::Vector3d point, direction;
  bool is_b{};
};

// The tables first and second.
struct PlateTables {
  metrology::Table first, second;

  PlateTables(const std::vector<Reading>& readings, const PlateAxis& axis, bool mounts) {
    const auto named = [mounts](const char* name, std::size_t from) {
      return mounts ? metrology::Table::withColumns(name, std::span{kColumnsOfPlateTables}.subspan(from))
                    : metrology::Table::withColumns(name, std::span{kColumnsOfOneMount}.subspan(from));
    };
    StopAngles angles;
    for (const auto& r : readings) angles.add(r.mount, stopOf(r.note), axis.is_b ? r.b_rad : r.c_rad);
    first = named("first", 0);
    second = named("second", 1);
    std::vector<Reading> of_first, of_second;
    for (const auto& reading : readings) {
      (stopOf(reading.note) == 0 ? of_second : of_first).push_back(reading);
      Eigen::Vector3d at = reading.centre.centre_mm;
      const std::uint16_t stop = stopOf(reading.note);
      const double phi_rad = angles.phi(stop);
      const double beside_rad = std::remainder(phi_rad - angles.turned(reading.mount, stop), kTurn);
      if (beside_rad != 0) at = axis.point + Eigen::AngleAxisd{beside_rad, axis.direction} * (at - axis.point);
      const double number = reading.mount;
      if (stop == 0) {
        mounts ? second.append({number, reading.ball, at.x(), at.y(), at.z()})
               : second.append({reading.ball, at.x(), at.y(), at.z()});
      } else {
        mounts ? first.append({phi_rad, number, reading.ball, at.x(), at.y(), at.z()})
               : first.append({phi_rad, reading.ball, at.x(), at.y(), at.z()});
      }
    }
    first.columns.push_back(timesOf(of_first));
    second.columns.push_back(timesOf(of_second));
  }
};

metrology::Table certificateOf(const BallPlate& plate, double balls) {
  auto third = metrology::Table::withColumns("third", std::span{kColumnsOfOneMount}.subspan(1));
  for (std::size_t k = 0; k < std::min(static_cast<std::size_t>(balls), plate.balls_mm.size()); ++k) {
    const auto& at = plate.balls_mm[k];
    third.append({static_cast<double>(k + 1), at[0], at[1], at[2]});
  }
  return third;
}

bool someAreOmitted(const std::vector<Reading>& readings, double balls) {
  double at_first_stop = 0;
  for (const auto& reading : readings) at_first_stop += reading.mount == 1 && stopOf(reading.note) == 1 ? 1 : 0;
  return at_first_stop < balls;
}

}  // namespace

std::optional<metrology::Refusal> whyMountsDiffer(const capture::Recording& recording) {
  std::array<StopAngles, 3> of_axis;
  for (const auto& touch : recording.touches()) {
    const auto& at = touch.request;
    for (std::size_t axis = 0; axis < of_axis.size(); ++axis)
      of_axis[axis].add(at.mount, stopOf(at.note), at.rotary_angles_rad[axis]);
  }
  double widest_rad = 0;
  for (const auto& angles : of_axis) widest_rad = std::max(widest_rad, angles.widest());
  if (widest_rad <= kPoseTolerance_rad) return std::nullopt;
  return metrology::Refusal{"mounts-differ",
                            "between its mounts the axis stopped at angles that differ by up to " +
                                std::to_string(degrees(widest_rad)) + " degrees, more than " +
                                std::to_string(kPoseTolerance_deg) +
                                ", and one angle cannot describe both: check that the axis is clamped and that its "
                                "reference has not moved, and measure again"};
}

void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts) {
  double balls = 0;
  bool about_b = false, mounts = false;
  for (const auto& reading : readings) {
    balls = std::max(balls, reading.ball);
    about_b = about_b || std::abs(reading.b_rad) > kLeastTilt_rad;  // C stands still while B is measured
    mounts = mounts || reading.mount > 1;
  }
  const BFacts b = facts.tilting_table.value_or(BFacts{});
  const auto direction = about_b ? b.axis : std::array<double, 3>{0, 0, 1};
  const auto point = about_b ? plate.b_axis_point_mm.value_or(plate.axis_point_mm) : plate.axis_point_mm;
  const double sigma_rad = about_b ? b.sigma_rad : facts.sigma_c_rad;
  const Eigen::Vector3d axis = vectorOf(direction);
  auto& config = dataset.config;
  config["axis"] = std::string{about_b ? "B" : "C"};
  config["axis_point_mm"] = std::vector<double>{point.begin(), point.end()};
  config["axis_direction"] = std::vector<double>{direction.begin(), direction.end()};
  config["sigma_mm"] = acrossSigmaOf(readings, axis);
  config["sigma_axial_mm"] = alongSigmaOf(readings, axis);
  if (sigma_rad > 0) config["sigma_angle_rad"] = sigma_rad;
  if (plate.sd_mm) config["sigma_third_mm"] = *plate.sd_mm;
  if (plate.station_correction || someAreOmitted(readings, balls)) config["station_correction"] = true;
  const PlateTables tables{readings, {vectorOf(point), axis.normalized(), about_b}, mounts};
  dataset.tables.insert(dataset.tables.begin(), {tables.first, tables.second, certificateOf(plate, balls)});
}

}  // namespace probebox::procedure
