#include "firmware/metrology/tool/tool_assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/setter_rounds.hpp"
#include "firmware/procedure/dataset/stop_shifts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/methods/setter_faces.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 3> kContactColumns{"W0_x_mm", "W0_y_mm", "L0_z_mm"};

metrology::Table readingsOf(const std::vector<Round>& rounds, const std::array<double, 3>& reference_mm) {
  auto readings = metrology::emptyTable(metrology::kToolAssembly, "readings");
  metrology::Column times = timesOf({});
  double rep = 0;
  for (const auto& round : rounds) {
    readings.append({1, ++rep, round.at_mm(0) - reference_mm[0], round.at_mm(1) - reference_mm[1],
                     round.from_above_mm[2] - reference_mm[2]});
    times.values.push_back(round.time_s);
  }
  readings.columns.push_back(std::move(times));
  return readings;
}

// From the unit's reference to the edge that was touched; nothing where both faces were.
void addPart(metrology::Dataset& dataset, const Round& round, const ToolSetter& unit) {
  std::vector<double> part_mm(3);
  for (std::size_t axis = 0; axis < part_mm.size(); ++axis)
    part_mm[axis] = axis == 2 ? unit.half_width_mm[2] : round.side(axis) * unit.half_width_mm[axis];
  const bool one_sided = part_mm[0] != 0 || part_mm[1] != 0;
  dataset.config["part_mm"] = std::move(part_mm);
  if (one_sided && unit.sd_half_width_mm)
    dataset.config["sd_part_mm"] = std::hypot(unit.sd_accepted_mm, *unit.sd_half_width_mm);
}

void addStores(metrology::Dataset& dataset, const ToolFacts& tool, const HolderFacts& holder) {
  auto holders = metrology::emptyTable(metrology::kToolAssembly, "holder_store");
  holders.append({static_cast<double>(holder.number), holder.length_mm, holder.sd_mm});
  auto tools = metrology::emptyTable(metrology::kToolAssembly, "tool_store");
  tools.append({static_cast<double>(tool.number), tool.length_mm, tool.sd_mm});
  dataset.config["holder_id"] = static_cast<double>(holder.number);
  dataset.config["tool_id"] = static_cast<double>(tool.number);
  dataset.tables.push_back(std::move(holders));
  dataset.tables.push_back(std::move(tools));
}

// Builds the case (CN103801980, docs/metrology.md C). The tool-setting device is the measuring unit: its accepted
// centre in machine.toml is reference B, its half width the distance from B to the touched edge. Each round is a row of
// readings: W0 from opposed faces or the one that the tool reaches, L0 from the top. The stores hold the lengths of
// holder and tool from machine.toml. The caller adds measured_at_s. Refuses what roundsOf() refuses.
RunDataset assemblyDataset(const FinishedRun& of) {
  auto [run, rounds, touches] = roundsOf(of);
  const ToolSetter& unit = *of.facts.tool_setter;
  const auto tool = std::ranges::find(of.facts.tools, of.recording.touches().back().request.tool, &ToolFacts::number);
  addStores(run.dataset, *tool, *tool->holder);
  if (unit.sd_accepted_mm > 0) run.dataset.config["sd_part_mm"] = unit.sd_accepted_mm;
  if (run.refusal) return std::move(run);
  addPart(run.dataset, rounds.front(), unit);
  auto& tables = run.dataset.tables;
  tables.insert(tables.begin(), readingsOf(rounds, *unit.accepted_mm));
  const std::vector<TouchingTip> tips{rounds.size(), {0, touchingTip(of.facts, tool->number)}};
  addStopsOfHead(run.dataset, "readings", kContactColumns, tips, of.facts);
  return std::move(run);
}

std::optional<NotReady> whyUnknownAssembly(const ProcedureOptions& options, const Facts& facts) {
  if (auto unknown = whyUnknownTool(options, facts)) return unknown;
  const auto tool = std::ranges::find(facts.tools, options.tool, &ToolFacts::number);
  if (tool == facts.tools.end() || tool->holder) return std::nullopt;
  return NotReady{Obstacle::option,
                  "The holder of tool " + std::to_string(options.tool) +
                      " is unknown: name it in its [[tool]] in machine.toml, and add a [[holder]] with its length."};
}

Outcome<ProcedureOptions> reachedFaces(ProcedureOptions options, const Facts& facts) {
  const auto tool = std::ranges::find(facts.tools, options.tool, &ToolFacts::number);
  if (tool != facts.tools.end()) options.faces = tool->faces;
  return options;
}

constexpr Fact kMeasuringUnit{
    .place = "`[tool_setter]` with `accepted_mm`, `[[tool]]` with its `[[holder]]`",
    .known = [](const Facts& facts) { return facts.tool_setter && facts.tool_setter->accepted_mm; },
    .missing =
        "a tool-setting device at a known position: give [tool_setter] with accepted_mm in machine.toml; "
        "tool-setter finds it (setter_mm of its result)."};
constexpr std::array kNeedsOfToolAssembly{&kMeasuringUnit};

constexpr Poses kToolAlone{
    .count = [](const ProcedureOptions&, const LoopState&) { return kRounds; },
    .at = [](const ProcedureOptions& options, const LoopState&, std::size_t) { return Pose{.tool = options.tool}; }};

}  // namespace

constinit const LiveMethod kToolAssembly{
    .number = 21,
    .solver = &metrology::kToolAssembly,
    .why_no_y =
        "finds where the tip of the tool is across X and Y, and no touch of a machine without Y tells "
        "the latter: tool-setter finds its offsets along X and Z.",
    .steps = "the same faces at B = 0, three rounds with the tool of `--tool N` alone",
    .needs = kNeedsOfToolAssembly,
    .finds_a_place = true,
    .feature = Feature::tool_setter,
    .sides = kSetterSides,
    .poses = kToolAlone,
    .usual = touchesAt(kTool_mm_s),
    .takes_tool = true,
    .also_refused = whyNoTool,
    .described = reachedFaces,
    .why_unfit = whyUnknownAssembly,
    .dataset = assemblyDataset,
    .speed_sets = kToolSpeedSets};

}  // namespace probebox::procedure
