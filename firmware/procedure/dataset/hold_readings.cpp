#include "firmware/procedure/dataset/hold_readings.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "firmware/procedure/dataset/ball_readings.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using metrology::Table;

constexpr std::array<std::string_view, 19> kHoldColumns{
    "touch", "reading", "ball", "tool",    "A_rad",   "B_rad",   "C_rad", "x_mm",  "y_mm", "z_mm",
    "s1",    "s2",      "s3",   "sd_x_mm", "sd_y_mm", "sd_z_mm", "sd_s1", "sd_s2", "sd_s3"};

// Mean of one column over the rows of a hold, and the sd of that mean.
struct Mean {
  double value{};
  double sd{};
};

// From the means of ten parts, one after the other: what sways more slowly than the samples come does not average away
// as their noise does.
Mean meanOf(std::span<const double> values) {
  const std::size_t parts = std::min<std::size_t>(10, values.size());
  const auto meanOver = [](std::span<const double> some) {
    double sum = 0;
    for (const double value : some) sum += value;
    return sum / static_cast<double>(some.size());
  };
  Mean mean{.value = meanOver(values), .sd = 0};
  double squares = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t from = part * values.size() / parts, to = (part + 1) * values.size() / parts;
    const double off = meanOver(values.subspan(from, to - from)) - mean.value;
    squares += off * off;
  }
  mean.sd = std::sqrt(squares / static_cast<double>(parts * (parts - 1)));
  return mean;
}

// Means of three columns, row by row of the touches: their rows stand one touch after the other.
void average(const Table& table, const std::array<const char*, 3>& columns, std::vector<Hold>& holds,
             Vector3d Hold::*mean, Vector3d Hold::*sd) {
  const auto& touch = *table.column("touch");
  std::size_t from = 0;
  for (auto& hold : holds) {
    std::size_t to = from;
    while (to < touch.size() && touch[to] == static_cast<double>(hold.request->step)) ++to;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto [value, sd_of_mean] = meanOf(std::span{*table.column(columns[i])}.subspan(from, to - from));
      (hold.*mean)[static_cast<Index>(i)] = value;
      (hold.*sd)[static_cast<Index>(i)] = sd_of_mean;
    }
    from = to;
  }
}

std::vector<Hold> holdsOf(const metrology::Dataset& rows, const capture::Recording& recording) {
  std::vector<Hold> holds;
  for (const auto& touch : recording.touches()) holds.push_back({&touch.request, {}, {}, {}, {}});
  average(*rows.table("machine"), {"x_mm", "y_mm", "z_mm"}, holds, &Hold::at_mm, &Hold::sd_at_mm);
  average(*rows.table("probe"), {"a", "b", "c"}, holds, &Hold::sensors, &Hold::sd_sensors);
  return holds;
}

Table tableOf(const std::vector<Hold>& holds) {
  auto table = Table::withColumns("holds", kHoldColumns);
  for (const auto& hold : holds) {
    const auto& request = *hold.request;
    const auto& [a, b, c] = request.rotary_angles_rad;
    const auto& [at, sensors, sd_at, sd_sensors] = std::tie(hold.at_mm, hold.sensors, hold.sd_at_mm, hold.sd_sensors);
    table.append({static_cast<double>(request.step), static_cast<double>(request.reading),
                  static_cast<double>(request.ball), static_cast<double>(request.tool), a, b, c, at[0], at[1], at[2],
                  sensors[0], sensors[1], sensors[2], sd_at[0], sd_at[1], sd_at[2], sd_sensors[0], sd_sensors[1],
                  sd_sensors[2]});
  }
  return table;
}

}  // namespace

HeldRun holdDataset(const FinishedRun& run) {
  HeldRun held{{touchesOf(run), {}, {}}, {}};
  auto& dataset = held.run.dataset;
  std::erase_if(dataset.tables, [](const Table& table) { return table.name == "touches"; });
  held.holds = holdsOf(dataset, run.recording);
  dataset.tables.push_back(tableOf(held.holds));
  return held;
}

}  // namespace probebox::procedure
