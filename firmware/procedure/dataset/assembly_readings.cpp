#include "firmware/procedure/dataset/assembly_readings.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "firmware/procedure/dataset/setter_rounds.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 5> kReadingsColumns{"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"};
constexpr std::array<std::string_view, 3> kHolderColumns{"holder_id", "L1_mm", "sd_mm"};
constexpr std::array<std::string_view, 3> kToolColumns{"tool_id", "L2_mm", "sd_mm"};

metrology::Table readingsOf(const std::vector<Round>& rounds, const std::array<double, 3>& reference_mm) {
  auto readings = metrology::Table::withColumns("readings", kReadingsColumns);
  double rep = 0;
  for (const auto& round : rounds) {
    readings.append({1, ++rep, round.middle_mm(0) - reference_mm[0], round.middle_mm(1) - reference_mm[1],
                     round.from_above_mm[2] - reference_mm[2]});
  }
  return readings;
}

void addStores(metrology::Dataset& dataset, const ToolFacts& tool, const HolderFacts& holder) {
  auto holders = metrology::Table::withColumns("holder_store", kHolderColumns);
  holders.append({static_cast<double>(holder.number), holder.length_mm, holder.sd_mm});
  auto tools = metrology::Table::withColumns("tool_store", kToolColumns);
  tools.append({static_cast<double>(tool.number), tool.length_mm, tool.sd_mm});
  dataset.config["holder_id"] = static_cast<double>(holder.number);
  dataset.config["tool_id"] = static_cast<double>(tool.number);
  dataset.tables.push_back(std::move(holders));
  dataset.tables.push_back(std::move(tools));
}

}  // namespace

RunDataset assemblyDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts) {
  auto [run, rounds] = roundsOf(recording, scales, Method::tool_assembly);
  const ToolSetter& unit = *facts.tool_setter;
  const auto tool = std::ranges::find(facts.tools, recording.touches().back().request.tool, &ToolFacts::number);
  addStores(run.dataset, *tool, *tool->holder);
  run.dataset.config["part_mm"] = std::vector<double>{0, 0, unit.half_width_mm[2]};
  if (unit.sd_accepted_mm > 0) run.dataset.config["sd_part_mm"] = unit.sd_accepted_mm;
  if (run.refusal) return std::move(run);
  auto& tables = run.dataset.tables;
  tables.insert(tables.begin(), readingsOf(rounds, *unit.accepted_mm));
  return std::move(run);
}

}  // namespace probebox::procedure
