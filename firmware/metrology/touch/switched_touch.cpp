#include "firmware/metrology/touch/switched_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/stamp_digits.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kSteadiness = 0.02;  // of the speed
constexpr double kNoise = 5;          // deviations of a slope that noise may make
constexpr double kNominal = 0.2;      // of the speed that was asked for
constexpr double kWild = 8;           // deviations of a position from its neighbours
constexpr double kRounded_mm = 1e-3;  // of way

// The positions of one touch: rows [begin, end) of table machine.
struct Positions {
  std::span<const double> times;
  Eigen::Map<const Eigen::VectorXd> x, y, z;
};

struct Planned {
  std::string name;
  Vector3d normal, retract;
  double speed_mm_s{};
};

Line lineOver(const Positions& of, std::size_t begin, std::size_t end) {
  Rows3 rows{static_cast<Eigen::Index>(end - begin), 3};
  for (std::size_t i = begin; i < end; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    rows.row(static_cast<Eigen::Index>(i - begin)) << of.x[k], of.y[k], of.z[k];
  }
  return fitLine(of.times.subspan(begin, end - begin), rows);
}

// How far a position is off the way between the two beside it; a rate that is not quite even is allowed for.
double besideItsNeighbours(std::span<const double> times, std::span<const double> values, std::size_t k) {
  const double share = (times[k] - times[k - 1]) / (times[k + 1] - times[k - 1]);
  return values[k] - values[k - 1] - share * (values[k + 1] - values[k - 1]);
}

// The largest distance of a single position from those beside it; 0 where the noise of the touch explains all. Where
// the machine sets out or arrives, one position is off its neighbours, and they are not.
double wildest_mm(const Positions& of, std::size_t begin, std::size_t end) {
  double wildest = 0;
  for (const auto* channel : {&of.x, &of.y, &of.z}) {
    const std::span values{channel->data(), of.times.size()};
    const double noise =
        std::max(localDeviation(of.times, values, Trim::heavy),
                 localDeviation(of.times.subspan(begin, end - begin), values.subspan(begin, end - begin), Trim::heavy));
    const double limit_mm = kWild * std::max({noise, resolutionOf(values), kCaseDigits});
    for (std::size_t k = std::max<std::size_t>(begin, 2); k < end && k + 2 < values.size(); ++k) {
      const double off = besideItsNeighbours(of.times, values, k);
      if (std::abs(off) <= limit_mm) continue;
      const double towards = std::max(besideItsNeighbours(of.times, values, k - 1) / off,
                                      besideItsNeighbours(of.times, values, k + 1) / off);
      if (towards < -0.25) wildest = std::max(wildest, std::abs(off));
    }
  }
  return wildest;
}

// Position at an edge, its velocity there, and its variance along the way.
struct Edge {
  Vector3d at_mm, velocity_mm_s;
  double variance{};
};

// Where the machine stood at the edge, the delay taken out. sense: -1 on the way in, 1 on the way out.
Outcome<Edge, Refusal> placeAt(double edge_s, double sense, const Positions& of, const Planned& planned,
                               const Vector3d& tau) {
  const auto refuse = [&](const char* name, const std::string& what) {
    return Refusal{name, planned.name + (sense < 0 ? ", way in: " : ", way out: ") + what};
  };
  const double window_s = kWayAtAnEdge_mm / planned.speed_mm_s;
  std::size_t begin = 0, end = of.times.size();
  while (begin < end && of.times[begin] < edge_s - window_s) ++begin;
  while (end > begin && of.times[end - 1] > edge_s + window_s) --end;
  if (end - begin < 2 * kFewestAtAnEdge) {
    return refuse("too-few-samples", "fewer than " + std::to_string(2 * kFewestAtAnEdge) +
                                         " positions about the edge: touch more slowly, or latch more often");
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const Line line = lineOver(of, begin, end), first = lineOver(of, begin, middle), last = lineOver(of, middle, end);
  const auto speedOf = [&](const Line& l) { return sense * l.slope.dot(planned.retract); };
  const double speed = speedOf(line);
  if (!(std::abs(speed - planned.speed_mm_s) <= kNominal * planned.speed_mm_s)) {
    return refuse("speed-differs", "the machine moves at " + text(speed) + " mm/s, not at " + text(planned.speed_mm_s) +
                                       ": check that the feed override is at 100 %");
  }
  // That of the halves: a bend would hide in the noise of the whole.
  const double scatter = first.scatterAlong(planned.retract) + last.scatterAlong(planned.retract);
  const double variance = scatter / static_cast<double>(line.n - 4);
  const double noise = std::sqrt(variance * (1 / first.sxx + 1 / last.sxx));
  if (std::abs(speedOf(first) - speedOf(last)) > kSteadiness * speed + kNoise * noise) {
    return refuse(
        "speed-not-constant",
        "the speed changes about the edge: approach and retract at constant speed, further beyond the surface");
  }
  if (const double off_mm = wildest_mm(of, begin, end); off_mm > 0) {
    return refuse("off-the-line", "one position about the edge is " + text(1e3 * off_mm) +
                                      " um off those beside it: check the encoders, and touch again");
  }
  const double from_mean_s = edge_s - line.t_mean;
  return Edge{.at_mm = line.at(edge_s) + tau.cwiseProduct(line.slope),
              .velocity_mm_s = line.slope,
              .variance = variance * (1.0 / static_cast<double>(line.n) + from_mean_s * from_mean_s / line.sxx)};
}

// The mean in which a delay common to both edges cancels, also at unequal speeds.
SwitchedTouch between(const Edge& in, const Edge& out, const Planned& planned) {
  const double in_mm_s = -in.velocity_mm_s.dot(planned.retract), out_mm_s = out.velocity_mm_s.dot(planned.retract);
  const double of_in = out_mm_s / (in_mm_s + out_mm_s), of_out = 1 - of_in;
  return {.normal = planned.normal,
          .at_mm = of_in * in.at_mm + of_out * out.at_mm,
          .sd_mm = std::sqrt(of_in * of_in * in.variance + of_out * of_out * out.variance),
          .speed_mm_s = planned.speed_mm_s,
          .late_s = (out.at_mm - in.at_mm).dot(planned.retract) / (in_mm_s + out_mm_s)};
}

// Edges of one touch or two may end in a coarse place by chance.
std::optional<Refusal> refuseRounded(const Table& edges, const Table& touches) {
  const auto& speeds = *touches.column(column::kSpeed);
  if (edges.rows() < 3 || speeds.empty()) return std::nullopt;
  const double digit_s =
      std::max(digitOfTimes(*edges.column(kEdgesColumns[1])), digitOfTimes(*edges.column(kEdgesColumns[2])));
  const double way_mm = digit_s * std::ranges::max(speeds);
  if (way_mm <= kRounded_mm) return std::nullopt;
  return Refusal{"coarse-stamps", "the edges in table 'edges' have digits of " + text(digit_s) + " s, in which " +
                                      text(way_mm) + " mm are covered: record microseconds"};
}

}  // namespace

Outcome<std::vector<SwitchedTouch>, Refusal> switchedTouches(const Dataset& dataset,
                                                             const std::array<double, 3>& tau_s) {
  TRY(const auto machine, checkedTable(dataset, "machine", kMachineColumns));
  TRY(const auto touches, checkedTable(dataset, "touches", kTouchesColumns));
  TRY(const auto edges, checkedTable(dataset, "edges", kEdgesColumns));
  const Vector3d tau{tau_s.data()};
  const auto cell = [](const Table& table, std::string_view column, std::size_t row) {
    return (*table.column(column))[row];
  };
  const auto& of_touch = *machine->column(column::kTouch);
  const auto part = [&](std::string_view column, std::size_t begin, std::size_t size) {
    return std::span{*machine->column(column)}.subspan(begin, size);
  };
  if (auto refusal = refuseRounded(*edges, *touches)) return *refusal;
  std::vector<SwitchedTouch> found;
  std::size_t begin = 0;
  for (std::size_t row = 0; row < touches->rows(); ++row) {
    const double number = cell(*touches, column::kTouch, row);
    std::size_t end = begin;
    while (end < of_touch.size() && of_touch[end] == number) ++end;
    const std::string name = "touch " + text(number);
    if (end == begin || row >= edges->rows() || cell(*edges, column::kTouch, row) != number)
      return Refusal{"missing-touch", name + " has no positions or no edges: measure it again"};
    const auto size = static_cast<Eigen::Index>(end - begin);
    const auto vectorOf = [&](std::string_view column) {
      return Eigen::Map<const Eigen::VectorXd>{part(column, begin, end - begin).data(), size};
    };
    const Positions positions{part(column::kTime, begin, end - begin), vectorOf(column::kX), vectorOf(column::kY),
                              vectorOf(column::kZ)};
    const auto direction = [&](std::string_view x, std::string_view y, std::string_view z) {
      return Vector3d{cell(*touches, x, row), cell(*touches, y, row), cell(*touches, z, row)};
    };
    const Planned planned{name, direction(column::kNormalX, column::kNormalY, column::kNormalZ),
                          direction(column::kAlongX, column::kAlongY, column::kAlongZ),
                          cell(*touches, column::kSpeed, row)};
    TRY(const auto in, placeAt(cell(*edges, kEdgesColumns[1], row), -1, positions, planned, tau));
    TRY(const auto out, placeAt(cell(*edges, kEdgesColumns[2], row), 1, positions, planned, tau));
    found.push_back(between(in, out, planned));
    begin = end;
  }
  return found;
}

}  // namespace probebox::metrology
