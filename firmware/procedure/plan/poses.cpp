#include "firmware/procedure/plan/poses.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::procedure {
namespace {

using Vector = std::array<double, 3>;

// Cosine: no stylus comes closer to the stem than 37 degrees.
constexpr double kStem = 0.8;
constexpr Vector kDown{0, 0, -1};
// Sine: a shank touches no side that looks down by more than 6 degrees.
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

// As ProcedureOptions::faces counts them.
unsigned bitOfFace(const Vector& normal) {
  for (std::size_t axis = 0; axis < normal.size(); ++axis) {
    if (normal[axis] != 0) return 1U << (2 * axis + (normal[axis] < 0 ? 1U : 0U));
  }
  return 0;
}

}  // namespace

constinit const Poses kAtZero{.count = [](const ProcedureOptions&, const LoopState&) { return std::size_t{1}; },
                              .at = [](const ProcedureOptions&, const LoopState&, std::size_t) { return Pose{}; }};

constinit const Poses kTwoByTwo{
    .count = [](const ProcedureOptions&, const LoopState&) { return std::size_t{4}; },
    .at = [](const ProcedureOptions&, const LoopState&, std::size_t index) { return twoByTwo(index); }};

Pose twoByTwo(std::size_t index) {
  return {{index >= 2 ? kHalfTurn_rad : 0.0, 0, index % 2 == 1 ? kHalfTurn_rad : 0.0}, 1};
}

double angleOfC(const ProcedureOptions& options, double from_rad, std::size_t index) {
  const bool whole_turn = options.arc_rad > kTurn_rad - 1e-9;
  const double intervals = whole_turn ? options.angles : options.angles - 1;
  return from_rad + options.arc_rad * static_cast<double>(index) / intervals;
}

std::span<const double> speedsOf(const ProcedureOptions& options) {
  return std::span{options.speeds_mm_s}.first(std::min<std::size_t>(options.speed_count, kMostSpeeds));
}

std::span<const double> anglesOfB(const ProcedureOptions& options) {
  return std::span{options.b_angles_rad}.first(std::min<std::size_t>(options.b_count, kMostBAngles));
}

std::span<const std::uint32_t> toolsOf(const ProcedureOptions& options) {
  return std::span{options.tools}.first(std::min<std::size_t>(options.tool_count, kMostProbeTools));
}

void carry(Pose& pose, const ProcedureOptions& options, std::size_t tool) {
  const auto tools = toolsOf(options);
  pose.tool = tools[tool];
  pose.by_shank = options.shank_height_mm > 0 && tool + 1 == tools.size();
}

Sides::Sides(std::span<const Side> all, const ProcedureOptions& options, const Pose& pose) {
  const auto moved = [&](const Vector& v, BMoves by) {
    return pose.b_moves == by && !pose.sides_stand ? turned(v, options.b_axis, pose.angles_rad[1]) : v;
  };
  const Vector stem = moved(kDown, BMoves::table);
  for (Side side : all) {
    if (options.faces != 0 && (options.faces & bitOfFace(side.outward_normal)) == 0) continue;
    if (pose.by_shank && std::abs(side.outward_normal[2]) > kBesideStem) continue;
    side.outward_normal = moved(side.outward_normal, BMoves::head);
    side.aside = moved(side.aside, BMoves::head);
    const double most = pose.by_shank ? kBesideStem : kStem;
    if (pose.b_moves != BMoves::nothing && !pose.sides_stand && dot(side.outward_normal, stem) > most) continue;
    sides_.at(count_++) = side;
  }
}

}  // namespace probebox::procedure
