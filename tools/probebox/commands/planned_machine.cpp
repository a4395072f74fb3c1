#include "tools/probebox/commands/planned_machine.hpp"

#include <cmath>
#include <cstddef>

#include "board/describe/file_content.hpp"
#include "board/describe/parse.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "tools/probebox/commands/described_machine.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// what: "machine.toml of the box (--machine)".
Outcome<std::string> textOf(const std::string& path, const char* what) {
  auto text = board::fileContent(path);
  if (!text) return Error{path + " cannot be read (" + text.error().what + "): give the " + what + "."};
  return text;
}

// The machine of a file, with the certified sphere of another.
Outcome<board::Machine> machineIn(const Plan& options, std::vector<std::string>& notes) {
  TRY(const auto text, textOf(options.machine, "machine.toml of the box (--machine)"));
  board::Descriptions described;
  TRY(described.machine, board::parseMachine(text, options.machine));
  if (options.unit.empty()) return described.machine;
  TRY(const auto of_unit, textOf(options.unit, "unit.toml of the box (--unit)"));
  TRY(const auto unit, board::parseUnit(of_unit, options.unit));
  if (auto other = board::applyUnit(unit, described)) notes.push_back(*std::move(other));
  return described.machine;
}

Outcome<board::Probe> probeIn(const Plan& options) {
  TRY(const auto text, textOf(options.probe, "probe.toml of the box (--probe)"));
  return board::parseProbe(text, options.probe);
}

std::string listed(const std::vector<std::string>& texts) {
  std::string all;
  for (const auto& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

// Of a measured rate no more than its whole hertz are of interest.
double rounded(double value) {
  return value >= 100 ? std::round(value) : value;
}

// Options replace what is described. What neither says is usual.
void choose(PlannedMachine& machine, const Plan& options, const messages::DescribeMachine::Answer& says) {
  plan::SetUp& set_up = machine.set_up;
  const auto take = [&](double& value, const std::optional<double>& given, bool described, const char* in_words) {
    if (!given) (described ? machine.told : machine.usual).push_back(printed(in_words, rounded(value)));
    value = given.value_or(value);
  };
  if (options.machine_rate_hz) set_up.axis_rates_hz.fill(0);
  const bool has_positions = says.positions_hz[0] > 0 && says.positions_hz[1] > 0 && says.positions_hz[2] > 0;
  take(set_up.machine_rate_hz, options.machine_rate_hz, has_positions, "%g positions a second");
  take(set_up.machine_noise_um, options.machine_noise_um, false, "positions with %g um of noise");
  if (options.switch_noise_um) set_up.switch_repeatability_um = options.switch_noise_um;
  if (!set_up.switch_repeatability_um) {
    take(set_up.probe_rate_hz, options.probe_rate_hz, says.deflections_hz > 0, "%g deflections a second");
    take(set_up.probe_noise_um, options.probe_noise_um, says.probe.noise_um > 0, "deflections with %g um of noise");
  }
  if (says.probe.ball_diameter_mm == 0)
    machine.usual.push_back(printed("a stylus ball of %g mm", set_up.stylus_ball_diameter_mm));
  take(set_up.acceleration_mm_s2, options.acceleration_mm_s2, false, "an acceleration of %g mm/s2");
}

// Runs at several angles of the head are forecast at one.
bool swivelsToo(const plan::Wanted& wanted, const messages::DescribeMachine::Answer& says) {
  if (wanted.method == &procedure::kPeriodicCheck)
    return !says.checked_ball.empty() && !says.checked_ball.front().swivels_rad.empty();
  return wanted.method == &procedure::kToolSetter && !says.setter.empty() && says.setter.front().swivels_rad.size() > 1;
}

// As the box would refuse the run now. Which results are in force is known from a box alone.
std::string whyRefusedThere(const PlannedMachine& machine, const plan::Wanted& wanted,
                            const messages::DescribeMachine::Answer& says) {
  const auto& [method, options] = wanted;
  const bool of_box = !machine.box.empty();
  const auto facts = describedFacts(machine.set_up, says, wanted, of_box);
  const auto by = procedure::readBy(options);
  const bool has_delay = !of_box || says.delay.calibrated;
  if (const auto why = procedure::whyUnready(*method, facts, has_delay, by)) return why->what;
  if (by == procedure::ReadBy::head) {
    if (const auto why = procedure::whyNoHead(*method, facts)) return why->what;
  }
  if (by == procedure::ReadBy::shank) {
    if (const auto why = procedure::whyNoShank(*method, facts)) return why->what;
  }
  const auto unfit = method->why_unfit != nullptr ? method->why_unfit(options, facts) : std::nullopt;
  if (unfit) return unfit->what;
  const auto completed = procedure::described(*method, options, facts, by);
  return completed ? std::string{} : completed.error().what;
}

}  // namespace

Outcome<PlannedMachine, Trouble> plannedMachine(const Plan& options, const plan::Wanted& wanted,
                                                const std::optional<AskedBox>& box) {
  PlannedMachine machine;
  messages::DescribeMachine::Answer says;
  if (box) {
    says = box->says;
    machine.box = box->uri;
    machine.name_in_box = says.machine;
    machine.probe = says.probe.name;
  }
  if (!options.machine.empty()) {
    const auto in_file = machineIn(options, machine.notes);
    if (!in_file) return Trouble{ExitStatus::usage, "bad-description", in_file.error().what};
    replaceMachine(says, *in_file);
    machine.file = options.machine;
    machine.unit_file = options.unit;
  }
  if (!options.probe.empty()) {
    const auto in_file = probeIn(options);
    if (!in_file) return Trouble{ExitStatus::usage, "bad-description", in_file.error().what};
    replaceProbe(says, *in_file);
    machine.probe = says.probe.name;
    machine.probe_file = options.probe;
  }
  machine.name = says.machine;
  const bool is_described = box || !machine.file.empty();
  if (!is_described) takeProbe(machine.set_up, says);
  if (is_described) takeMachine(machine.set_up, says, wanted);
  choose(machine, options, says);
  if (swivelsToo(wanted, says)) machine.usual.emplace_back("the head at 0 alone");
  if (is_described) machine.why_refused = whyRefusedThere(machine, wanted, says);
  return machine;
}

Json describe(const PlannedMachine& machine) {
  const auto orNull = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  const auto& set_up = machine.set_up;
  return {{"name", orNull(machine.name)},
          {"box", orNull(machine.box)},
          {"file", orNull(machine.file)},
          {"unit_file", orNull(machine.unit_file)},
          {"probe_file", orNull(machine.probe_file)},
          {"probe", orNull(machine.probe)},
          {"positions_hz", set_up.machine_rate_hz},
          {"positions_noise_um", set_up.machine_noise_um},
          {"deflections_hz", set_up.switch_repeatability_um ? Json(nullptr) : Json(set_up.probe_rate_hz)},
          {"deflections_noise_um", set_up.switch_repeatability_um ? Json(nullptr) : Json(set_up.probe_noise_um)},
          {"switch_noise_um", set_up.switch_repeatability_um ? Json(*set_up.switch_repeatability_um) : Json(nullptr)},
          {"usual", machine.usual},
          {"why_refused", orNull(machine.why_refused)}};
}

std::vector<std::string> inWords(const PlannedMachine& machine) {
  std::vector<std::string> lines;
  const bool own_probe = !machine.probe_file.empty();
  if (machine.name.empty()) {
    lines.emplace_back("for a usual machine, no particular one: name a box with -u, or give --machine FILE");
  } else if (machine.file.empty()) {
    lines.push_back("for " + machine.name + (own_probe ? "" : " with " + machine.probe) + ", as the box " +
                    machine.box + " says");
  } else if (machine.box.empty()) {
    lines.push_back("for " + machine.name + ", as " + machine.file + " says; no box was asked");
  } else {
    lines.push_back(
        "for " + machine.name + ", as " + machine.file + " says in the place of " + machine.name_in_box +
        " of the box " + machine.box +
        (own_probe ? "; with its rates of positions" : "; with its " + machine.probe + ", rates and delay"));
  }
  if (!machine.unit_file.empty()) lines.push_back("with the datum sphere of " + machine.unit_file);
  if (own_probe) lines.push_back("with the probe " + machine.probe + ", as " + machine.probe_file + " says");
  if (!machine.told.empty())
    lines.push_back((machine.box.empty() || own_probe ? "described: " : "of the box: ") + listed(machine.told));
  lines.insert(lines.end(), machine.notes.begin(), machine.notes.end());
  if (!machine.usual.empty()) lines.push_back("usual, because nothing says otherwise: " + listed(machine.usual));
  if (!machine.why_refused.empty()) lines.push_back("there the run would be refused: " + machine.why_refused);
  return lines;
}

}  // namespace probebox::command
