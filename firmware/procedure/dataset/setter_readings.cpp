#include "firmware/procedure/dataset/setter_readings.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/procedure/dataset/setter_rounds.hpp"

namespace probebox::procedure {
namespace {

using metrology::Refusal;

constexpr std::array<std::string_view, 4> kReadingsColumns{"is_tool", "x_mm", "y_mm", "z_mm"};
// More than any device trips before or behind its faces: half_width_mm or the ball is another one.
constexpr double kWidthTolerance_mm = 0.1;

std::optional<Refusal> wrongWidth(const std::vector<Round>& rounds, const ToolSetter& setter, double ball_mm) {
  for (const auto& round : rounds) {
    for (std::size_t axis = 0; axis < 2 && round.tool == 0; ++axis) {
      const double stated = 2 * setter.half_width_mm[axis] + ball_mm;
      const double found = round.width_mm(axis);
      if (std::abs(found - stated) <= kWidthTolerance_mm) continue;
      return Refusal{"setter-width-wrong",
                     std::string{"along "} + "XYZ"[axis] + " the probe measures device plus stylus ball as " +
                         std::to_string(found) + " mm wide, but " + std::to_string(stated) +
                         " is stated: check [tool_setter] half_width_mm and the stylus ball's diameter"};
    }
  }
  return std::nullopt;
}

metrology::Table readingsOf(const std::vector<Round>& rounds, const ToolSetter& setter, double ball_mm) {
  auto readings = metrology::Table::withColumns("readings", kReadingsColumns);
  for (const auto& round : rounds) {
    // A tool's length ends at its tip, the probe's at the centre of its ball.
    const double above_mm = setter.half_width_mm[2] + (round.tool != 0 ? 0 : ball_mm / 2);
    readings.append(
        {round.tool != 0 ? 1.0 : 0.0, round.middle_mm(0), round.middle_mm(1), round.from_above_mm[2] - above_mm});
  }
  return readings;
}

void addKeys(metrology::Dataset& dataset, const capture::Recording& recording, const ToolSetter& setter) {
  const auto list = [](const auto& values) { return std::vector<double>{values.begin(), values.end()}; };
  auto& config = dataset.config;
  config["tool"] = static_cast<double>(recording.touches().back().request.tool);
  config["probe_offset_mm"] = list(setter.probe_offset_mm);
  if (setter.sd_probe_offset_mm) config["sd_probe_offset_mm"] = *setter.sd_probe_offset_mm;
  if (setter.accepted_mm) {
    config["accepted_setter_mm"] = list(*setter.accepted_mm);
    config["setter_limit_mm"] = setter.limit_mm;
  }
}

}  // namespace

RunDataset setterDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts) {
  auto [run, rounds] = roundsOf(recording, scales, Method::tool_setter);
  const ToolSetter& setter = *facts.tool_setter;
  addKeys(run.dataset, recording, setter);
  if (!run.refusal) run.refusal = wrongWidth(rounds, setter, facts.stylus_ball_diameter_mm);
  if (run.refusal) return std::move(run);
  auto& tables = run.dataset.tables;
  tables.insert(tables.begin(), readingsOf(rounds, setter, facts.stylus_ball_diameter_mm));
  return std::move(run);
}

}  // namespace probebox::procedure
