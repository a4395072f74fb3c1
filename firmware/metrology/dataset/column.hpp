#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <ranges>
#include <string_view>
#include <vector>

// Columns of the tables of a case, described once beside the solver that reads them. Checks, plausible ranges, faults
// that are looked for, pages and pictures follow from the role of a column.
namespace probebox::metrology {

enum class ColumnRole : std::uint8_t {
  none,            // not described
  number,          // of a touch, a ball, a face; or which of several things the row is about
  given,           // a length, a speed or an sd that is stated
  direction,       // component of a unit vector
  stamp,           // time of a sample, from any epoch
  coordinate,      // reading along a machine axis
  set_coordinate,  // the same: set or certified, or read in one direction alone
  angle,           // of an axis
  rotation,        // angle of a screw that turns while it is read
  contact_angle,   // reading of an angle at a contact
  deflection,      // channel of a probe, in its unit
  sensor,          // reading of a displacement, in um
  face,            // deviation of the worked face of a screw's end, in um
};

// What a case may have instead of readings in a column.
enum class MayBe : std::uint8_t {
  read,
  zero,     // throughout, where it was not measured
  set,      // whole numbers, where an axis was sent
  missing,  // the column itself; MethodTable::about says when
};

struct MethodColumn {
  std::string_view name;  // unit included
  ColumnRole role{};
  double most{};  // largest plausible size, in the unit of the name; 0: what the unit allows
  MayBe may_be{};

  constexpr operator std::string_view() const { return name; }
  constexpr MethodColumn as(ColumnRole own) const { return {name, own, most, may_be}; }
  constexpr MethodColumn orBe(MayBe instead) const { return {name, role, most, instead}; }
};

// Names of columns, of a list of names or of described columns.
class ColumnNames {
 public:
  ColumnNames(std::initializer_list<std::string_view> names) : names_(names) {}
  template <std::ranges::range Names>
  requires std::convertible_to<std::ranges::range_reference_t<const Names>, std::string_view> ColumnNames(
      const Names& names)
      : names_(std::ranges::begin(names), std::ranges::end(names)) {}

  auto begin() const { return names_.begin(); }
  auto end() const { return names_.end(); }
  std::size_t size() const { return names_.size(); }
  std::string_view operator[](std::size_t k) const { return names_[k]; }

 private:
  std::vector<std::string_view> names_;
};

// The unit that a name ends with; words may follow that of an angle: "C_rad_clockwise_from_plus_y".
constexpr bool isInRadians(std::string_view name) {
  return name.ends_with("_rad") || name.find("_rad_") != std::string_view::npos;
}
constexpr bool isInDegrees(std::string_view name) {
  return name.ends_with("_deg");
}

// True of a position along a machine axis, read or not.
constexpr bool isCoordinate(ColumnRole role) {
  return role == ColumnRole::coordinate || role == ColumnRole::set_coordinate;
}

// Columns of several methods.
namespace column {

constexpr MethodColumn number(std::string_view name) {
  return {name, ColumnRole::number};
}
constexpr MethodColumn given(std::string_view name, double most = 0) {
  return {name, ColumnRole::given, most};
}

inline constexpr double kMostTilt_deg = 720;  // a head or a table that tilts has no two turns

inline constexpr MethodColumn kTouch{"touch", ColumnRole::number}, kScan{"scan", ColumnRole::number},
    kBall{"ball", ColumnRole::number}, kStop{"stop", ColumnRole::number}, kTool{"tool", ColumnRole::number};
inline constexpr MethodColumn kTime{"t_s", ColumnRole::stamp};
// When a row was read, from any epoch. Any table of readings may have it, whether its method describes it or not.
inline constexpr MethodColumn kReadAt{"time_s", ColumnRole::stamp};
inline constexpr MethodColumn kX{"x_mm", ColumnRole::coordinate}, kY{"y_mm", ColumnRole::coordinate},
    kZ{"z_mm", ColumnRole::coordinate};
inline constexpr MethodColumn kPosition[]{kX, kY, kZ};
inline constexpr MethodColumn kSetX = kX.as(ColumnRole::set_coordinate), kSetY = kY.as(ColumnRole::set_coordinate),
                              kSetZ = kZ.as(ColumnRole::set_coordinate);
inline constexpr MethodColumn kNormalX{"nx", ColumnRole::direction}, kNormalY{"ny", ColumnRole::direction},
    kNormalZ{"nz", ColumnRole::direction};
inline constexpr MethodColumn kNormal[]{kNormalX, kNormalY, kNormalZ};
// Of a retract, of the touch of a shank, or of a joint.
inline constexpr MethodColumn kAlongX{"ux", ColumnRole::direction}, kAlongY{"uy", ColumnRole::direction},
    kAlongZ{"uz", ColumnRole::direction};
inline constexpr MethodColumn kChannels[]{
    {"a", ColumnRole::deflection}, {"b", ColumnRole::deflection}, {"c", ColumnRole::deflection}};
inline constexpr MethodColumn kDistance{"distance_mm", ColumnRole::deflection};
inline constexpr MethodColumn kSpeed{"speed_mm_s", ColumnRole::given};
// Angles of the spindle (A), of the head or table that tilts (B), and of C.
inline constexpr MethodColumn kA{"A_rad", ColumnRole::angle}, kC{"C_rad", ColumnRole::angle};
inline constexpr MethodColumn kADegrees{"A_deg", ColumnRole::angle}, kCDegrees{"C_deg", ColumnRole::angle};
inline constexpr MethodColumn kB{"B_deg", ColumnRole::angle, kMostTilt_deg};
inline constexpr MethodColumn kCClockwise{"C_rad_clockwise_from_plus_y", ColumnRole::angle};
// C where the ball touches the stylus on either side.
inline constexpr MethodColumn kContacts[]{{"C1_rad", ColumnRole::contact_angle}, {"C2_rad", ColumnRole::contact_angle}};
inline constexpr MethodColumn kToolLength{"L_mm", ColumnRole::given};
inline constexpr MethodColumn kPhi{"phi_rad", ColumnRole::angle};
inline constexpr MethodColumn kSensor{"sensor_um", ColumnRole::sensor};

}  // namespace column

// Tables of every touch method. Streams keep their native rates, each with its own stamps on the master clock. machine:
// position of the moving reference. probe: raw deflection channels. touches: outward normal n, unit direction u of the
// retract, nominal speed.
inline constexpr MethodColumn kMachineColumns[]{column::kTouch, column::kTime, column::kX, column::kY, column::kZ};
inline constexpr MethodColumn kProbeColumns[]{column::kTouch, column::kTime, column::kChannels[0], column::kChannels[1],
                                              column::kChannels[2]};
inline constexpr MethodColumn kTouchesColumns[]{column::kTouch,  column::kNormalX, column::kNormalY, column::kNormalZ,
                                                column::kAlongX, column::kAlongY,  column::kAlongZ,  column::kSpeed};

// Tables of every scan method.
inline constexpr MethodColumn kScanMachineColumns[]{column::kScan, column::kTime, column::kX, column::kY, column::kZ};
inline constexpr MethodColumn kScanProbeColumns[]{column::kScan, column::kTime, column::kChannels[0],
                                                  column::kChannels[1], column::kChannels[2]};
inline constexpr MethodColumn kScansColumns[]{column::kScan, column::kSpeed};

}  // namespace probebox::metrology
