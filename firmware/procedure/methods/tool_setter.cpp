#include "firmware/metrology/tool/tool_setter.hpp"

#include <Eigen/Geometry>
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
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using metrology::Refusal;

constexpr std::array<std::string_view, 3> kPlace{"x_mm", "y_mm", "z_mm"};
// More than any device trips before or behind its faces: half_width_mm or the ball is another one.
constexpr double kWidthTolerance_mm = 0.1;

std::optional<Refusal> wrongWidth(const std::vector<Round>& rounds, const ToolSetter& setter, double ball_mm) {
  for (const auto& round : rounds) {
    for (std::size_t axis = 0; axis < 2 && round.tool == 0; ++axis) {
      const bool untouched = round.above[axis] == 0 && round.below[axis] == 0;  // Y of a lathe without one
      if (untouched || round.side(axis) != 0) continue;
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

// A tool's length ends at its tip, the probe's at the centre of its ball: the solver subtracts its radius.
metrology::Table readingsOf(const std::vector<Round>& rounds, const ToolSetter& setter) {
  auto readings = metrology::emptyTable(metrology::kToolSetter, "readings");
  metrology::Column times = timesOf({});
  for (const auto& round : rounds) {
    const double z_mm = round.from_above_mm[2] - setter.half_width_mm[2];
    readings.append({round.tool != 0 ? 1.0 : 0.0, round.at_mm(0), round.at_mm(1), z_mm});
    times.values.push_back(round.time_s);
  }
  readings.columns.push_back(std::move(times));
  return readings;
}

// A tool's edge is what touched: no radius of it is taken off.
metrology::Table facesOf(const std::vector<metrology::SwitchedTouch>& touches, const FinishedRun& of, bool several_b) {
  using metrology::column::kB;
  auto table = metrology::emptyTable(metrology::kToolSetter, "touches",
                                     several_b ? metrology::ColumnNames{kB} : metrology::ColumnNames{});
  metrology::Column times = timesOf({});
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto& request = of.recording.touches()[i].request;
    const auto& n = request.outward_normal;
    const auto& at = touches[i].at_mm;
    const double is_tool = request.tool != 0 ? 1.0 : 0.0, half_mm = of.facts.tool_setter->half_width_mm[axisAlong(n)];
    if (several_b) {
      table.append(
          {is_tool, n[0], n[1], n[2], half_mm, 0, at.x(), at.y(), at.z(), degrees(request.rotary_angles_rad[1])});
    } else {
      table.append({is_tool, n[0], n[1], n[2], half_mm, 0, at.x(), at.y(), at.z()});
    }
    times.values.push_back(timeOf(of.recording, of.recording.touches()[i]));
  }
  table.columns.push_back(std::move(times));
  return table;
}

// What each row of `touches` touched with.
std::vector<TouchingTip> tipsOf(const FinishedRun& of) {
  std::vector<TouchingTip> tips;
  for (const auto& touch : of.recording.touches())
    tips.push_back({touch.request.rotary_angles_rad[1], touchingTip(of.facts, touch.request.tool)});
  return tips;
}

// The same of each row of `readings`, all of them with a level head.
std::vector<TouchingTip> tipsOf(const std::vector<Round>& rounds, const Facts& facts) {
  std::vector<TouchingTip> tips;
  for (const auto& round : rounds) tips.push_back({0, touchingTip(facts, round.tool)});
  return tips;
}

std::vector<double> listOf(const auto& values) {
  return {values.begin(), values.end()};
}

// Where the probe's tip is with the head at each of the angles, by nominal kinematics.
metrology::Table offsetsOf(const ToolSetter& setter, const HeadFacts& head) {
  auto table = metrology::emptyTable(metrology::kToolSetter, "probe_offsets");
  const Eigen::Vector3d pivot = vectorOf(head.pivot_mm), arm = vectorOf(setter.probe_offset_mm) - pivot;
  for (const double b_rad : setter.swivels_rad) {
    const Eigen::Vector3d tip = pivot + Eigen::AngleAxisd{b_rad, vectorOf(head.b.axis)} * arm;
    table.append({degrees(b_rad), tip.x(), tip.y(), tip.z()});
  }
  return table;
}

// The link of the device to the turning axis (B22b), at the height where the probe's tip was when that was measured.
void addTurningAxis(metrology::Dataset& dataset, const TurningAxis& axis, const ToolSetter& setter) {
  auto& config = dataset.config;
  config["centreline_mm"] = listOf(axis.at_mm);
  config["centreline_result"] = static_cast<double>(axis.result_id);
  if (axis.sd_mm > 0) config["sd_centreline_mm"] = axis.sd_mm;
  if (!axis.tilt_rad) return;
  config["C_tilt_rad"] = listOf(*axis.tilt_rad);
  config["centreline_z_mm"] = axis.z_mm + setter.probe_offset_mm[2];
  if (axis.sd_tilt_rad > 0) config["sd_C_tilt_rad"] = axis.sd_tilt_rad;
}

void addKeys(metrology::Dataset& dataset, const FinishedRun& of, const ToolSetter& setter, bool several_b) {
  auto& config = dataset.config;
  // The probe is 0, and the last one again.
  const auto numberOf = [](const capture::Touch& touch) { return touch.request.tool; };
  config["tool"] = static_cast<double>(numberOf(std::ranges::max(of.recording.touches(), {}, numberOf)));
  if (!of.facts.has_y) config["machine_axes"] = std::string{"XZ"};
  if (!several_b) config["probe_offset_mm"] = listOf(setter.probe_offset_mm);
  if (setter.probe_offset_result != 0) config["stylus_offset_result"] = static_cast<double>(setter.probe_offset_result);
  if (setter.sd_probe_offset_mm) config["sd_probe_offset_mm"] = *setter.sd_probe_offset_mm;
  if (setter.accepted_mm) {
    config["accepted_setter_mm"] = listOf(*setter.accepted_mm);
    config["setter_limit_mm"] = setter.limit_mm;
  }
  if (of.facts.turning_axis) addTurningAxis(dataset, *of.facts.turning_axis, setter);
}

// Builds the case. With both faces of X and Y at one B, each round is a row of readings: the machine position with the
// tip at the centre of the device (docs/metrology.md B.9), for the probe above it by the stylus radius; the half width
// is subtracted from the top. Otherwise each touch is a row of touches, with its face. Refuses: no-delay;
// setter-width-wrong (the measured width differs from the stated one); what switchedTouches() refuses.
RunDataset setterDataset(const FinishedRun& of) {
  auto [run, rounds, touches] = roundsOf(of);
  const ToolSetter& setter = *of.facts.tool_setter;
  const double ball_mm = of.facts.stylus_ball_diameter_mm;
  const bool several_b = setter.swivels_rad.size() > 1;
  addKeys(run.dataset, of, setter, several_b);
  if (setter.tilt_unknown)
    run.warnings.emplace_back(
        "spindle-tilt-unknown: the offset of the stylus in force counts from the spindle's axis, and probe_offset_mm "
        "from "
        "the head's reference: they differ by the axis' tilt times its length, which no result in force tells "
        "(a-axis-alignment measures it)");
  if (!run.refusal) run.refusal = wrongWidth(rounds, setter, ball_mm);
  if (run.refusal) return std::move(run);
  auto& tables = run.dataset.tables;
  const bool one_sided =
      std::ranges::any_of(rounds, [](const Round& round) { return round.side(0) != 0 || round.side(1) != 0; });
  const bool by_touches = several_b || one_sided;
  addStylusBall(run.dataset, of.facts);
  auto& config = run.dataset.config;
  config["stylus_ball_radius_mm"] = ball_mm / 2;
  if (const auto& sd = of.facts.sd_stylus_ball_diameter_mm) config["sd_stylus_ball_radius_mm"] = *sd / 2;
  if (!by_touches) {
    tables.insert(tables.begin(), readingsOf(rounds, setter));
    addStopsOfHead(run.dataset, "readings", kPlace, tipsOf(rounds, of.facts), of.facts);
    return std::move(run);
  }
  if (setter.sd_half_width_mm) config["sd_half_width_mm"] = *setter.sd_half_width_mm;
  // Positions are in table contacts; the touches as planned stay in the recording's own table under another name.
  const auto planned = std::ranges::find(tables, "touches", &metrology::Table::name);
  if (planned != tables.end()) planned->name = "planned_touches";
  tables.insert(tables.begin(), facesOf(touches, of, several_b));
  if (several_b) tables.insert(tables.begin() + 1, offsetsOf(setter, *of.facts.swivel_head));
  addStopsOfHead(run.dataset, "touches", kPlace, tipsOf(of), of.facts);
  return std::move(run);
}

constexpr Fact kToolSetterAndTool{
    .place = "`[tool_setter]` and `[[tool]]`, its line in box.toml",
    .known = [](const Facts& facts) { return facts.tool_setter.has_value(); },
    .missing = "a tool-setting device: give [tool_setter] in machine.toml, and its line as a [[trigger]] in box.toml."};
constexpr std::array kNeedsOfToolSetter{&kToolSetterAndTool};

// The probe first, then the tool, each at all angles of the head.
constexpr Poses kToolChange{
    .count = [](const ProcedureOptions& options, const LoopState&) { return 2 * kRounds * anglesOfB(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const auto angles = anglesOfB(options);
          const std::size_t of_one = kRounds * angles.size();
          Pose pose{.tool = index < of_one ? 0 : options.tool};
          pose.angles_rad[1] = angles[index % of_one / kRounds];
          pose.b_moves = angles.size() > 1 ? BMoves::head : BMoves::nothing;
          pose.sides_stand = true;
          return pose;
        }};

// The faces that the tool reaches, and the angles of the head.
Outcome<ProcedureOptions> setterOptions(ProcedureOptions options, const Facts& facts) {
  const auto tool = std::ranges::find(facts.tools, options.tool, &ToolFacts::number);
  if (tool != facts.tools.end()) options.faces = tool->faces;
  const auto& setter = facts.tool_setter;
  if (!setter || setter->swivels_rad.size() < 2 || !facts.swivel_head) return options;
  if (options.faces == 0) {
    return Error{"Where the head swivels, a tool reaches one face an axis: give the [[tool]] with number " +
                 std::to_string(options.tool) + " its faces in machine.toml, such as " +
                 (facts.has_y ? R"(["+X", "+Y", "+Z"])" : R"(["+X", "+Z"])") + "."};
  }
  options.b_count = static_cast<std::uint8_t>(setter->swivels_rad.size());
  std::ranges::copy(setter->swivels_rad, options.b_angles_rad.begin());
  options.b_axis = facts.swivel_head->b.axis;
  return options;
}

}  // namespace

constinit const LiveMethod kToolSetter{
    .number = 20,
    .solver = &metrology::kToolSetter,
    .steps =
        "faces +X, -X, +Y, -Y, +Z, +Z of the tool-setting device, or those of them that the tool reaches (`faces`), "
        "three rounds with the probe and three with the tool of `--tool N`, at 5 mm/s, A and C at 0; the same at "
        "each B of `swivels_deg`",
    .needs = kNeedsOfToolSetter,
    .finds_a_place = true,
    .feature = Feature::tool_setter,
    .sides = kSetterSides,
    .poses = kToolChange,
    .usual = with(touchesAt(kTool_mm_s),
                  [](auto& options) {
                    options.b_count = 1;
                    options.b_axis = {0, 1, 0};
                  }),
    .closes = 1,
    .takes_tool = true,
    .also_refused = whyNoTool,
    .described = setterOptions,
    .why_unfit = whyUnknownTool,
    .dataset = setterDataset,
    .speed_sets = kToolSpeedSets};

}  // namespace probebox::procedure
