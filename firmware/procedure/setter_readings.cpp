#include "firmware/procedure/setter_readings.hpp"

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/switched_touch.hpp"

namespace probebox::procedure {
namespace {

using metrology::Refusal;
using metrology::SwitchedTouch;

constexpr std::array<std::string_view, 4> kReadingsColumns{"is_tool", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 7> kContactsColumns{"touch", "reading", "tool",  "x_mm",
                                                           "y_mm",  "z_mm",    "late_s"};
// More than any device trips before or behind its faces: half_width_mm or the ball is another one.
constexpr double kWidthTolerance_mm = 0.1;

// The faces of one round: the mean position along each axis of the touches from either side.
struct Round {
  bool is_tool{};
  std::array<double, 3> from_above_mm{}, from_below_mm{};
  std::array<int, 3> above{}, below{};

  void add(const SwitchedTouch& touch) {
    const auto axis = [&] {
      Eigen::Index along = 0;
      touch.normal.cwiseAbs().maxCoeff(&along);
      return static_cast<std::size_t>(along);
    }();
    const double at_mm = touch.at_mm[static_cast<Eigen::Index>(axis)];
    auto& mean = touch.normal[static_cast<Eigen::Index>(axis)] > 0 ? from_above_mm[axis] : from_below_mm[axis];
    auto& count = touch.normal[static_cast<Eigen::Index>(axis)] > 0 ? above[axis] : below[axis];
    ++count;
    mean += (at_mm - mean) / count;
  }
  double middle_mm(std::size_t axis) const { return (from_above_mm[axis] + from_below_mm[axis]) / 2; }
  double width_mm(std::size_t axis) const { return from_above_mm[axis] - from_below_mm[axis]; }
};

std::vector<Round> roundsOf(const std::vector<SwitchedTouch>& touches, const capture::Recording& recording) {
  std::vector<Round> rounds;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto& request = recording.touches()[i].request;
    if (request.reading >= rounds.size()) rounds.push_back({.is_tool = request.tool != 0});
    rounds.back().add(touches[i]);
  }
  return rounds;
}

std::optional<Refusal> wrongWidth(const std::vector<Round>& rounds, const ToolSetter& setter, double ball_mm) {
  for (const auto& round : rounds) {
    for (std::size_t axis = 0; axis < 2 && !round.is_tool; ++axis) {
      const double stated = 2 * setter.half_width_mm[axis] + ball_mm;
      const double found = round.width_mm(axis);
      if (std::abs(found - stated) <= kWidthTolerance_mm) continue;
      return Refusal{"setter-width-wrong",
                     std::string{"along "} + "XYZ"[axis] + " the probe finds the device and its ball " +
                         std::to_string(found) + " mm wide together, and " + std::to_string(stated) +
                         " is stated: look at [tool_setter] half_width_mm and the stylus ball's diameter"};
    }
  }
  return std::nullopt;
}

metrology::Table contactsOf(const std::vector<SwitchedTouch>& touches, const capture::Recording& recording) {
  auto contacts = metrology::Table::withColumns("contacts", kContactsColumns);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto& request = recording.touches()[i].request;
    const auto& at = touches[i].at_mm;
    contacts.append({static_cast<double>(request.step), static_cast<double>(request.reading),
                     static_cast<double>(request.tool), at.x(), at.y(), at.z(), touches[i].late_s});
  }
  return contacts;
}

metrology::Table readingsOf(const std::vector<Round>& rounds, const ToolSetter& setter, double ball_mm) {
  auto readings = metrology::Table::withColumns("readings", kReadingsColumns);
  for (const auto& round : rounds) {
    // A tool's length ends at its tip, the probe's at the centre of its ball.
    const double above_mm = setter.half_width_mm[2] + (round.is_tool ? 0 : ball_mm / 2);
    readings.append(
        {round.is_tool ? 1.0 : 0.0, round.middle_mm(0), round.middle_mm(1), round.from_above_mm[2] - above_mm});
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
  RunDataset run{capture::edgeDataset(recording, scales, "tool-setter"), {}, {}};
  const ToolSetter& setter = *facts.tool_setter;
  addKeys(run.dataset, recording, setter);
  const auto& delay = recording.delay();
  if (delay.result_id == 0) {
    run.refusal = Refusal{"no-delay",
                          "no system delay is in force, so the touches lie beside the surface by an unknown lag: "
                          "calibrate the delay first, accept it, and measure again"};
    return run;
  }
  run.dataset.config["previous_tau_axis_s"] = std::vector<double>{delay.tau_s.begin(), delay.tau_s.end()};
  const auto touches = metrology::switchedTouches(run.dataset, delay.tau_s);
  if (!touches) {
    run.refusal = touches.error();
    return run;
  }
  run.dataset.tables.push_back(contactsOf(*touches, recording));
  const auto rounds = roundsOf(*touches, recording);
  run.refusal = wrongWidth(rounds, setter, facts.stylus_ball_diameter_mm);
  if (run.refusal) return run;
  auto& tables = run.dataset.tables;
  tables.insert(tables.begin(), readingsOf(rounds, setter, facts.stylus_ball_diameter_mm));
  return run;
}

}  // namespace probebox::procedure
