#include "firmware/procedure/plan/poses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::procedure {
namespace {

using Vector = std::array<double, 3>;

constexpr double kHalfTurn_rad = std::numbers::pi;
// Nearer to the stem than this no stylus comes: 37 degrees.
constexpr double kStem = 0.8;
constexpr Vector kDown{0, 0, -1};
// So far down may a side look that a shank touches: 6 degrees.
constexpr double kBesideStem = 0.1;

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Right-handed about a unit vector. What ought to be zero is zero, so that sides keep their names.
Vector turned(const Vector& v, const Vector& about, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), along = (1 - c) * dot(about, v);
  Vector result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    result[i] = c * v[i] + s * (about[j] * v[k] - about[k] * v[j]) + along * about[i];
    if (std::abs(result[i]) < 1e-12) result[i] = 0;
  }
  return result;
}

// C from zero on, or to either side of it.
Pose aroundC(const MethodRow& row, const Chosen& with, std::size_t index) {
  const bool whole_turn = with.arc_rad > usual::kTurn_rad - 1e-9;
  const double intervals = whole_turn ? with.angles : with.angles - 1;
  const double from_rad = row.poses == Poses::within_reach ? -with.arc_rad / 2 : 0;
  return {{0, 0, from_rad + with.arc_rad * static_cast<double>(index) / intervals}, 1};
}

// All balls at each angle, and at the end once more where C began: there they tell where the plate is.
Pose onPlate(const MethodRow& row, const Chosen& with, std::size_t index) {
  const std::size_t stop = index / with.balls;
  Pose pose = stop < with.angles ? aroundC(row, with, stop) : Pose{};
  pose.ball = static_cast<std::uint16_t>(index % with.balls + 1);
  return pose;
}

// Of several balls the part turns as seldom as can be: C is outermost, then A, then the balls. One ball is read after a
// turn of C each, so that no two readings share what C stops beside its angle.
Pose twoByTwo(const MethodRow& row, const Chosen& with, std::size_t index) {
  const auto half_turn = [](bool turned) { return turned ? kHalfTurn_rad : 0.0; };
  if (!row.heights) return {{half_turn(index >= 2), 0, half_turn(index % 2 == 1)}, 1};
  const std::size_t turned = index / with.balls;
  return {{half_turn(turned % 2 == 1), 0, half_turn(turned >= 2)}, static_cast<std::uint16_t>(index % with.balls + 1)};
}

// C stands still while the table tilts: what it stops beside its angle is then a part of where the ball stands.
Pose tilted(const Chosen& with, std::size_t index) {
  const std::size_t tilts = with.b_angles_rad.size();
  return {{0, with.b_angles_rad[index % tilts], index < tilts ? 0.0 : kHalfTurn_rad}, 1, BMoves::table};
}

// The same of A and a head, before a ball that stands still.
Pose swivelled(const Chosen& with, std::size_t index) {
  const std::size_t angles = with.b_angles_rad.size();
  return {{index < angles ? 0.0 : kHalfTurn_rad, with.b_angles_rad[index % angles], 0}, 0, BMoves::head};
}

// With that one of the tools, or the shank in the place of the last.
void take(Pose& pose, const Chosen& with, std::size_t tool) {
  pose.tool = with.tools[tool];
  pose.by_shank = with.shank_height_mm > 0 && tool + 1 == with.tools.size();
}

// Both readings of which the mean is taken belong to one stop of B.
Pose byLength(const Chosen& with, std::size_t index) {
  const std::size_t stop = index / 2, angles = with.b_angles_rad.size();
  Pose pose{{index % 2 == 0 ? 0.0 : kHalfTurn_rad, with.b_angles_rad[stop % angles], 0}, 0, BMoves::head};
  take(pose, with, stop / angles);
  return pose;
}

// Step 1 finds where the stylus hangs; then every loop has +theta and -theta from its zero, and the last one zero too.
Pose rimStep(const Chosen& with, std::size_t index) {
  if (index < 2) return {{index == 0 ? 0.0 : kHalfTurn_rad, 0, with.c_on_line_rad}, 1};
  const std::size_t k = index - 2, loop = std::min(k / 2, with.loops.count - 1);
  const double theta_rad = with.arc_rad / 2, zero_rad = with.loops.zeros_rad[loop];
  const double c_rad = k / 2 == with.loops.count ? 0 : k % 2 == 0 ? theta_rad : -theta_rad;
  Pose pose{{0, 0, with.c_on_line_rad - zero_rad - c_rad}, 1};
  pose.rim = {.loop = static_cast<std::uint16_t>(loop + 1), .zero_rad = zero_rad, .c_rad = c_rad};
  return pose;
}

bool swivels(const MethodRow& row) {
  return row.poses == Poses::swivelled || row.poses == Poses::by_length;
}

}  // namespace

Chosen chosen(const MethodRow& row, const ProcedureOptions& options) {
  const auto or_usual = [](auto value, auto usual) { return value == 0 ? usual : value; };
  const auto speed_count = std::min<std::size_t>(options.speed_count, kMostSpeeds);
  const auto b_count = std::min<std::size_t>(options.b_count, kMostBAngles);
  const auto tool_count = std::min<std::size_t>(options.tool_count, kMostProbeTools);
  const bool reach = row.poses == Poses::within_reach || row.poses == Poses::rim_steps;
  const auto usual_angles = reach                       ? usual::kReachAngles
                            : row.poses == Poses::plate ? usual::kPlateAngles
                                                        : usual::kAngles;
  return {
      .speeds_mm_s = speed_count > 0 ? std::span{options.speeds_mm_s}.first(speed_count) : row.speeds_mm_s,
      .overtravel_mm = or_usual(options.overtravel_mm, usual::kOvertravel_mm),
      .clearance_mm = or_usual(options.clearance_mm, usual::kClearance_mm),
      .approach_rad = row.off_normal ? or_usual(options.approach_rad, usual::kApproach_rad) : 0,
      .arc_rad = or_usual(options.arc_rad, reach ? usual::kReach_rad : usual::kTurn_rad),
      .angles = or_usual(options.angles, usual_angles),
      .balls = row.heights ? or_usual(options.balls, usual::kBalls) : std::uint16_t{1},
      .tool = options.tool,
      .b_axis = options.b_axis != Vector{} ? options.b_axis
                : swivels(row)             ? usual::kSwivelAxis
                                           : usual::kTiltAxis,
      .b_angles_rad = b_count > 0    ? std::span{options.b_angles_rad}.first(b_count)
                      : swivels(row) ? std::span<const double>{usual::kSwivels_rad}
                                     : std::span<const double>{usual::kTilts_rad},
      .tools = tool_count > 0 ? std::span{options.tools}.first(tool_count) : std::span{usual::kTools},
      .shank_height_mm = options.shank_height_mm,
      .c_on_line_rad = options.c_on_line_rad,
  };
}

bool spreadsC(const MethodRow& row) {
  return countsAngles(row) || row.poses == Poses::rim_steps;
}

bool countsAngles(const MethodRow& row) {
  return row.poses == Poses::around_c || row.poses == Poses::within_reach || row.poses == Poses::plate;
}

bool turnsB(const MethodRow& row) {
  return row.poses == Poses::tilted || swivels(row);
}

bool changesTools(const MethodRow& row) {
  return row.poses == Poses::by_length || row.poses == Poses::two_by_two_by_length;
}

std::size_t poseCount(const MethodRow& row, const Chosen& with) {
  if (row.poses == Poses::one || row.poses == Poses::level) return 1;
  if (row.poses == Poses::plate) return (std::size_t{with.angles} + 1) * with.balls;
  if (row.poses == Poses::tool_change) return 2 * usual::kRounds;
  if (row.poses == Poses::tool_alone) return usual::kRounds;
  const std::size_t tools = changesTools(row) ? with.tools.size() : 1;
  if (turnsB(row)) return 2 * with.b_angles_rad.size() * tools;
  if (row.poses == Poses::rim_steps) return 2 + 2 * with.loops.count + (with.loops.closes ? 1 : 0);
  return countsAngles(row) ? std::size_t{with.angles} : std::size_t{4} * with.balls * tools;
}

Pose poseOf(const MethodRow& row, const Chosen& with, std::size_t index) {
  switch (row.poses) {
    case Poses::one:
    case Poses::level:
      return {};
    case Poses::around_c:
    case Poses::within_reach:
      return aroundC(row, with, index);
    case Poses::together: {
      const double both_rad = kHalfTurn_rad / 2 * static_cast<double>(index);
      return {{both_rad, 0, both_rad}, 1};
    }
    case Poses::two_by_two:
      return twoByTwo(row, with, index);
    case Poses::plate:
      return onPlate(row, with, index);
    case Poses::two_by_two_by_length: {
      Pose pose = twoByTwo(row, with, index % 4);
      take(pose, with, index / 4);
      return pose;
    }
    case Poses::tool_change:
      return {.tool = index < usual::kRounds ? 0 : with.tool};
    case Poses::tool_alone:
      return {.tool = with.tool};
    case Poses::tilted:
      return tilted(with, index);
    case Poses::swivelled:
      return swivelled(with, index);
    case Poses::by_length:
      return byLength(with, index);
    case Poses::rim_steps:
      return rimStep(with, index);
  }
  return {};
}

Sides::Sides(const MethodRow& row, const Chosen& with, const Pose& pose) {
  const auto moved = [&](const Vector& v, BMoves by) {
    return pose.b_moves == by ? turned(v, with.b_axis, pose.angles_rad[1]) : v;
  };
  const Vector stem = moved(kDown, BMoves::table);
  for (Side side : row.sides) {
    if (pose.by_shank && std::abs(side.outward_normal[2]) > kBesideStem) continue;
    side.outward_normal = moved(side.outward_normal, BMoves::head);
    side.aside = moved(side.aside, BMoves::head);
    const double most = pose.by_shank ? kBesideStem : kStem;
    if (pose.b_moves != BMoves::nothing && dot(side.outward_normal, stem) > most) continue;
    sides_.at(count_++) = side;
  }
}

}  // namespace probebox::procedure
