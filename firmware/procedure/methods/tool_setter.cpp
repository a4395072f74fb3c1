#include "firmware/metrology/tool/tool_setter.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/procedure/dataset/setter_rounds.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/methods/setter_faces.hpp"

namespace probebox::procedure {
namespace {

using metrology::Refusal;

constexpr std::array<std::string_view, 4> kReadingsColumnsOfToolSetter{"is_tool", "x_mm", "y_mm", "z_mm"};
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
  auto readings = metrology::Table::withColumns("readings", kReadingsColumnsOfToolSetter);
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

// Builds the case: each round is a row of readings, the machine position with the tip at the centre of the device
// (docs/metrology.md B.9). Opposed faces give X and Y; half width and, for the probe, the stylus radius are subtracted
// from the top. Refuses: no-delay; setter-width-wrong (the measured width differs from the stated one); what
// switchedTouches() refuses.
RunDataset setterDataset(const FinishedRun& of) {
  auto [run, rounds] = roundsOf(of);
  const ToolSetter& setter = *of.facts.tool_setter;
  const double ball_mm = of.facts.stylus_ball_diameter_mm;
  addKeys(run.dataset, of.recording, setter);
  if (!run.refusal) run.refusal = wrongWidth(rounds, setter, ball_mm);
  if (run.refusal) return std::move(run);
  auto& tables = run.dataset.tables;
  tables.insert(tables.begin(), readingsOf(rounds, setter, ball_mm));
  return std::move(run);
}

constexpr Fact kToolSetterAndTool{
    .place = "`[tool_setter]` and `[[tool]]`, its line in box.toml",
    .known = [](const Facts& facts) { return facts.tool_setter.has_value(); },
    .missing = "a tool-setting device: give [tool_setter] in machine.toml, and its line as a [[trigger]] in box.toml."};
constexpr std::array kNeedsOfToolSetter{&kToolSetterAndTool};

// The probe first, then the tool.
constexpr Poses kToolChange{.count = [](const ProcedureOptions&, const LoopState&) { return 2 * kRounds; },
                            .at = [](const ProcedureOptions& options, const LoopState&,
                                     std::size_t index) { return Pose{.tool = index < kRounds ? 0 : options.tool}; }};

}  // namespace

constinit const LiveMethod kToolSetter{
    .number = 20,
    .solver = &metrology::kToolSetter,
    .steps =
        "faces +X, -X, +Y, -Y, +Z, +Z of the tool-setting device, three rounds with the probe and three with the "
        "tool of `--tool N`, at 5 mm/s, A and C at 0",
    .needs = kNeedsOfToolSetter,
    .finds_a_place = true,
    .feature = Feature::tool_setter,
    .sides = kSetterSides,
    .poses = kToolChange,
    .usual = touchesAt(kTool_mm_s),
    .takes_tool = true,
    .also_refused = whyNoTool,
    .why_unfit = whyUnknownTool,
    .dataset = setterDataset,
    .speed_sets = kToolSpeedSets};

}  // namespace probebox::procedure
