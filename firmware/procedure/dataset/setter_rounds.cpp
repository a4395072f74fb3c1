#include "firmware/procedure/dataset/setter_rounds.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/metrology/touch/switched_touch.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/known_delay.hpp"
#include "firmware/procedure/plan/live_method.hpp"

namespace probebox::procedure {
namespace {

using metrology::Refusal;
using metrology::SwitchedTouch;

constexpr std::array<std::string_view, 7> kContactsColumns{"touch", "reading", "tool",  "x_mm",
                                                           "y_mm",  "z_mm",    "late_s"};

void add(const SwitchedTouch& touch, double time_s, Round& round) {
  Eigen::Index along = 0;
  touch.normal.cwiseAbs().maxCoeff(&along);
  const auto axis = static_cast<std::size_t>(along);
  const bool from_above = touch.normal[along] > 0;
  auto& mean = from_above ? round.from_above_mm[axis] : round.from_below_mm[axis];
  auto& count = from_above ? round.above[axis] : round.below[axis];
  ++count;
  mean += (touch.at_mm[along] - mean) / count;
  double touches = 0;
  for (std::size_t k = 0; k < 3; ++k) touches += round.above.at(k) + round.below.at(k);
  round.time_s += (time_s - round.time_s) / touches;
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

}  // namespace

Rounds roundsOf(const FinishedRun& of) {
  const auto& recording = of.recording;
  Rounds found{{capture::edgeDataset(recording, of.scales, std::string{of.method.name()}), {}, {}}, {}, {}};
  auto& dataset = found.run.dataset;
  auto& refusal = found.run.refusal;
  const auto& delay = recording.delay();
  if (lacksAnAxis(delay) && !of.facts.trigger_probe) {
    refusal = Refusal{
        "no-delay",
        "no system delay of every axis is in force, so the touches are displaced from the surface by an unknown lag: "
        "calibrate the delay first, accept it, and measure again"};
    return found;
  }
  if (delay.result_id != 0) dataset.config["delay_result"] = static_cast<double>(delay.result_id);
  dataset.config["previous_tau_axis_s"] = std::vector<double>{delay.tau_s.begin(), delay.tau_s.end()};
  auto touches = metrology::switchedTouches(dataset, delay.tau_s);
  if (!touches) {
    refusal = touches.error();
    return found;
  }
  dataset.tables.push_back(contactsOf(*touches, recording));
  for (std::size_t i = 0; i < touches->size(); ++i) {
    const auto& request = recording.touches()[i].request;
    if (request.reading >= found.rounds.size()) found.rounds.push_back({.tool = request.tool});
    add((*touches)[i], timeOf(recording, recording.touches()[i]), found.rounds.back());
  }
  found.touches = std::move(*touches);
  return found;
}

Eigen::Vector3d touchingTip(const Facts& facts, std::uint32_t tool) {
  const auto found = std::ranges::find(facts.tools, tool, &ToolFacts::number);
  if (tool != 0 && found != facts.tools.end()) return {0, 0, -found->length_mm};
  return facts.tool_setter ? Eigen::Vector3d{facts.tool_setter->probe_offset_mm.data()} : Eigen::Vector3d::Zero();
}

}  // namespace probebox::procedure
