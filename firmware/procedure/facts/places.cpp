#include "firmware/procedure/facts/places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::procedure {
namespace {

constexpr const char* kTyped = "machine.toml";

std::string resultNumbered(std::uint64_t id) {
  return "result " + std::to_string(id);
}

// Fills the table and the facts row by row.
class Table {
 public:
  explicit Table(std::string_view kept) : kept_{kept} {}

  // True where the measured value is the one to use.
  bool add(std::string name, std::optional<Known> typed, std::optional<Known> measured) {
    const bool takes = measured && name != kept_;
    rows_.push_back({std::move(name), std::move(typed), std::move(measured), {}});
    return takes;
  }
  void addMeasured(std::string name, Known newer, Known older) {
    rows_.push_back({std::move(name), {}, std::move(newer), std::move(older)});
  }
  std::vector<PlaceRow> take() { return std::move(rows_); }

 private:
  std::string_view kept_;
  std::vector<PlaceRow> rows_;
};

// By the tool that carries the probe: results that name none are of tool 1.
std::uint32_t probeToolOf(const Facts& facts) {
  return facts.probe_tools.count > 0 ? facts.probe_tools.numbers[0] : 1;
}

// The offset of a stylus counts from the spindle's axis at its own height, that of the tool setter from the head's
// reference: they differ by the tilt of the axis over the length between. Along the spindle it is as it is typed.
void takeStylus(Table& table, Facts& facts, const MeasuredPlaces& measured) {
  const auto tool = probeToolOf(facts);
  const auto found = std::ranges::find(measured.styli, tool, &MeasuredStylus::tool);
  if (!facts.tool_setter || found == measured.styli.end()) return;
  auto& setter = *facts.tool_setter;
  const double sd_typed_mm = setter.sd_probe_offset_mm.value_or(0);
  const auto tilt_rad = measured.spindle_tilt_rad.value_or(std::array<double, 2>{});
  const double below_mm = setter.probe_offset_mm[2];
  const double sd_mm =
      found->sd_mm > 0 ? std::hypot(found->sd_mm, below_mm * measured.sd_spindle_tilt_rad) : found->sd_mm;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    double& mm = setter.probe_offset_mm[axis];
    const Known by_result{resultNumbered(found->result_id), found->at_mm[axis] + below_mm * tilt_rad[axis], sd_mm};
    const auto name = "stylus-offset-" + std::to_string(tool) + " " + "XY"[axis];
    if (!table.add(name, Known{kTyped, mm, sd_typed_mm}, by_result)) continue;
    mm = by_result.mm;
    setter.probe_offset_result = found->result_id;
    setter.tilt_unknown = !measured.spindle_tilt_rad;
    if (sd_mm > 0) setter.sd_probe_offset_mm = std::max(sd_typed_mm, sd_mm);
  }
}

void takeLengths(Table& table, Facts& facts, const MeasuredPlaces& measured) {
  for (const auto& length : measured.tool_lengths) {
    const auto typed_mm = facts.lengthOf(length.tool);
    if (typed_mm == 0) continue;  // no tool that carries the probe
    const bool takes = table.add("assembly-" + std::to_string(length.tool) + " length",
                                 Known{kTyped, typed_mm, facts.sdOfLength(length.tool)},
                                 Known{resultNumbered(length.result_id), length.length_mm, length.sd_mm});
    if (takes) facts.takeLength(length.tool, length.length_mm, length.result_id, length.sd_mm);
  }
}

void takeBall(Table& table, CheckedBall& ball, const MeasuredPlaces& measured) {
  const auto known = [](const char* by, const std::optional<AcceptedValue>& value) {
    return value ? std::optional{Known{by, value->mm, value->sd_mm}} : std::nullopt;
  };
  const auto by = resultNumbered(measured.check_result);
  const auto take = [&](const char* name, std::optional<AcceptedValue>& value,
                        const std::optional<AcceptedValue>& found) {
    if (table.add(std::string{"check "} + name, known(kTyped, value), known(by.c_str(), found))) value = found;
  };
  if (measured.ball_x) take("X", ball.accepted_x, measured.ball_x);
  if (measured.ball_y) take("Y", ball.accepted_y, measured.ball_y);
  ball.accepted_y45 = measured.ball_y45;
  ball.accepted_y90 = measured.ball_y90;
  ball.accepted_x90 = measured.ball_x90;
  ball.accepted_z90 = measured.ball_z90;
  if (std::optional height{ball.centre_z}; measured.ball_z) {
    take("ball Z", height, measured.ball_z);
    ball.centre_z = *height;
  }
}

void takeSetter(Table& table, ToolSetter& setter, const MeasuredPlaces& measured) {
  if (!measured.setter_mm) return;
  auto at_mm = *measured.setter_mm;
  if (!measured.setter_tells_y) at_mm[1] = setter.accepted_mm ? (*setter.accepted_mm)[1] : 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis == 1 && !measured.setter_tells_y) continue;
    const auto typed = setter.accepted_mm
                           ? std::optional{Known{kTyped, (*setter.accepted_mm)[axis], setter.sd_accepted_mm}}
                           : std::nullopt;
    const Known by_result{resultNumbered(measured.setter_result), at_mm[axis], measured.sd_setter_mm};
    table.add(std::string{"setter "} + "XYZ"[axis], typed, by_result);
  }
  setter.accepted_mm = at_mm;
  setter.sd_accepted_mm = measured.sd_setter_mm;
}

// The point on the tilt axis, by which the ways of a run are judged. Along the axis any place is as good.
void takeTablePivot(Table& table, BFacts& tilting, const MeasuredPlaces& measured) {
  auto point_mm = tilting.point_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& found = measured.table_pivot[axis];
    if (!found) continue;
    const auto typed = tilting.point_mm ? std::optional{Known{kTyped, (*tilting.point_mm)[axis], 0}} : std::nullopt;
    const Known by_result{resultNumbered(measured.table_pivot_result), found->mm, found->sd_mm};
    if (!table.add(std::string{"table-pivot "} + "XYZ"[axis], typed, by_result)) continue;
    if (!point_mm) point_mm.emplace();
    (*point_mm)[axis] = found->mm;
  }
  tilting.point_mm = point_mm;
}

// What tool-setter and tool-assembly say about one tool: its tip across the spindle, and its length by that of the
// probe.
void compareTools(Table& table, const Facts& facts, const MeasuredPlaces& measured) {
  for (const auto& tip : measured.tool_tips) {
    const auto length = std::ranges::find(measured.tool_lengths, tip.tool, &MeasuredLength::tool);
    if (length == measured.tool_lengths.end()) continue;
    const auto add = [&](const char* what, double by_setter_mm, double sd_setter_mm, double by_assembly_mm,
                         double sd_assembly_mm) {
      Known newer{resultNumbered(tip.result_id), by_setter_mm, sd_setter_mm};
      Known older{resultNumbered(length->result_id), by_assembly_mm, sd_assembly_mm};
      if (length->result_id > tip.result_id) std::swap(newer, older);
      table.addMeasured("tool-" + std::to_string(tip.tool) + " " + what, std::move(newer), std::move(older));
    };
    for (std::size_t axis = 0; axis < 2 && length->tip_mm; ++axis)
      add(axis == 0 ? "X" : "Y", tip.at_mm[axis], tip.sd_mm[axis], (*length->tip_mm)[axis], length->sd_tip_mm);
    const double probe_mm = facts.lengthOf(probeToolOf(facts)), sd_probe_mm = facts.sdOfLength(probeToolOf(facts));
    if (probe_mm == 0 || !facts.tool_setter) continue;
    add("length", probe_mm - (tip.at_mm[2] - facts.tool_setter->probe_offset_mm[2]),
        std::hypot(tip.sd_mm[2], sd_probe_mm), length->length_mm, length->sd_mm);
  }
}

std::string inWords(const Known& known) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.4f mm by %s", known.mm, known.by.c_str());
  return text.data();
}

}  // namespace

std::vector<PlaceRow> takeMeasured(Facts& facts, const MeasuredPlaces& measured, std::string_view kept) {
  Table table{kept};
  takeStylus(table, facts, measured);
  takeLengths(table, facts, measured);
  if (facts.checked_ball) takeBall(table, *facts.checked_ball, measured);
  if (facts.tool_setter) takeSetter(table, *facts.tool_setter, measured);
  if (facts.tilting_table) takeTablePivot(table, *facts.tilting_table, measured);
  compareTools(table, facts, measured);
  return table.take();
}

std::optional<std::string> disagreement(const PlaceRow& row) {
  const auto& other = row.other ? row.other : row.typed;
  if (!row.measured || !other || row.measured->sd_mm <= 0 || other->sd_mm <= 0) return std::nullopt;
  const double apart_mm = std::abs(row.measured->mm - other->mm);
  const double sd_mm = std::hypot(row.measured->sd_mm, other->sd_mm);
  if (apart_mm <= kMostApart_sd * sd_mm) return std::nullopt;
  std::array<char, 64> apart{};
  std::snprintf(apart.data(), apart.size(), "%.1f um, %.0f sd", 1e3 * apart_mm, apart_mm / sd_mm);
  return "places-disagree: " + row.name + " is " + inWords(*row.measured) + ", which is used, and " + inWords(*other) +
         " (" + apart.data() + " apart): measure the one again, or correct the other";
}

}  // namespace probebox::procedure
