#include "firmware/procedure/plan/plan.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/nearest.hpp"
#include "tools/case/quantities.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kProposals = 5;  // proposals, on a page

procedure::BFacts bOf(const board::TiltDescription& b, procedure::BFacts usual) {
  usual.axis = b.axis;
  usual.sigma_rad = b.sigma_rad;
  usual.count = b.angles_deg.size();
  std::ranges::transform(b.angles_deg, usual.angles_rad.begin(), [](double angle_deg) { return radians(angle_deg); });
  return usual;
}

// Balls of the part are those of the plate, from C and from the axis of the table.
std::vector<std::array<double, 3>> ballsOf(const board::BallPlateDescription& plate, const board::Machine& machine) {
  const auto& table = machine.tilting_table;
  const double axis_z_mm = table && table->point_mm ? (*table->point_mm)[2] : plate.axis_point_mm[2];
  auto balls = plate.balls_mm;
  for (auto& ball : balls) ball[2] += plate.axis_point_mm[2] - axis_z_mm;
  return balls;
}

void take(plan::SetUp& set_up, const board::Machine& machine) {
  set_up.sigma_c_rad = machine.sigma_c_rad;
  set_up.sphere_diameter_mm = machine.datum_sphere_diameter_mm.value_or(set_up.sphere_diameter_mm);
  set_up.gap_mm = machine.datum_gap_mm.value_or(set_up.gap_mm);
  if (machine.tilting_table) set_up.table = bOf(*machine.tilting_table, set_up.table);
  if (machine.swivel_head) {
    set_up.head = bOf(machine.swivel_head->swivel, set_up.head);
    set_up.pivot_mm = machine.swivel_head->pivot_mm;
  }
  if (machine.ball_plate) set_up.balls_mm = ballsOf(*machine.ball_plate, machine);
  for (std::size_t i = 0; i < std::min(machine.probe_tools.size(), set_up.tool_lengths_mm.size()); ++i)
    set_up.tool_lengths_mm[i] = machine.probe_tools[i].length_mm;
  if (machine.probe_shank) {
    set_up.shank_height_mm = machine.probe_shank->height_mm;
    set_up.shank_radius_mm = machine.probe_shank->radius_mm;
  }
}

Outcome<plan::SetUp> setUpOf(const Plan& options) {
  plan::SetUp set_up;
  if (!options.machine.empty()) {
    std::ifstream file{options.machine};
    if (!file) return Error{options.machine + " cannot be read: give the machine.toml of the box (--machine)."};
    const std::string text{std::istreambuf_iterator<char>{file}, {}};
    TRY(const auto machine, board::parseMachine(text, options.machine));
    take(set_up, machine);
  }
  const auto choose = [](double& value, const std::optional<double>& given) { value = given.value_or(value); };
  choose(set_up.machine_rate_hz, options.machine_rate_hz);
  choose(set_up.machine_noise_um, options.machine_noise_um);
  choose(set_up.probe_rate_hz, options.probe_rate_hz);
  choose(set_up.probe_noise_um, options.probe_noise_um);
  choose(set_up.acceleration_mm_s2, options.acceleration_mm_s2);
  if (options.switch_noise_um) set_up.switch_repeatability_um = options.switch_noise_um;
  return set_up;
}

// With names and units as those of a result.
std::vector<casefolder::Quantity> quantitiesOf(const plan::Forecast& forecast) {
  metrology::Result result;
  result.estimates = forecast.estimates;
  result.also = forecast.also;
  return casefolder::quantitiesOf(result, forecast.axis);
}

// "+/- 1.9 us".
std::string spreadOf(const casefolder::Quantity& quantity) {
  const auto u = quantity.uncertainty();
  return "+/- " + (u ? casefolder::withUnit(quantity.label, *u) : "?");
}

Json forecastJson(const plan::Forecast& forecast) {
  Json sd = Json::object(), expanded = Json::object(), dropped = Json::array();
  for (const auto& quantity : quantitiesOf(forecast)) {
    sd[quantity.key] = quantity.sd ? Json(*quantity.sd) : Json(nullptr);
    expanded[quantity.key] = quantity.expanded ? Json(*quantity.expanded) : Json(nullptr);
  }
  for (const auto& one : forecast.dropped) dropped.push_back({{"name", one.name}, {"reason", one.reason}});
  const auto& options = forecast.wanted.options;
  const std::vector<double> speeds{options.speeds_mm_s.begin(), options.speeds_mm_s.begin() + options.speed_count};
  return {{"method", forecast.wanted.method->name()},
          {"options", chosenOf(forecast.wanted)},
          {"speeds_mm_s", speeds},
          {"angles", options.angles},
          {"balls", options.balls},
          {"touches", forecast.steps},
          {"duration_s", forecast.duration_s},
          {"sd", sd},
          {"expanded_k2", expanded},
          {"dropped", dropped}};
}

// "25 touches", "1 sweep", "2 turns of C and 25 touches".
std::string stepsOf(const plan::Forecast& forecast) {
  const auto& wanted = forecast.wanted;
  const bool holds = wanted.options.head || wanted.method->kind == procedure::Kind::hold;
  const bool sweeps = wanted.method->takes_turns, rests = wanted.method->kind == procedure::Kind::rest,
             scans = wanted.method->kind == procedure::Kind::scan;
  const std::string one = sweeps ? "sweep" : rests ? "rest" : scans ? "scan" : holds ? "hold" : "touch";
  const std::size_t turns = wanted.options.contacts ? 2 : 0, others = forecast.steps - turns;
  return (turns > 0 ? std::to_string(turns) + " turns of C and " : "") + std::to_string(others) + " " + one +
         (others == 1      ? ""
          : one == "touch" ? "es"
                           : "s");
}

std::string forecastPage(const plan::Forecast& forecast) {
  std::string all = std::string{forecast.wanted.method->name()} + ": " + stepsOf(forecast) +
                    printed(", about %.0f s", forecast.duration_s);
  for (const auto& quantity : quantitiesOf(forecast)) {
    all += printed("\n  %-22s ", quantity.label.name.c_str()) + printed("%-16s ", spreadOf(quantity).c_str());
    if (quantity.expanded) all += "U (k = 2) " + casefolder::withUnit(quantity.label, *quantity.expanded);
  }
  for (const auto& dropped : forecast.dropped) all += "\n  left out: " + dropped.name + ", " + dropped.reason;
  return all + "\n  (+/- u, k = 1, of readings and descriptions; without the certificates of sphere and stylus ball)";
}

ExitStatus propose(const plan::Wanted& wanted, const plan::SetUp& set_up, const Plan& options, Console& console) {
  const auto found = plan::proposals(wanted, set_up, *options.time_s);
  if (!found) return console.fail({ExitStatus::failed, found.error().name, found.error().reason});
  if (found->empty())
    return console.fail(
        {ExitStatus::failed, "nothing-fits",
         printed("no set of touches that this method can use fits into %g s; allow more time", *options.time_s)});
  if (!console.json()) console.line(forecastPage(found->front()));
  if (!console.json()) console.line("the most precise that fit into " + printed("%g s:", *options.time_s));
  for (std::size_t i = 0; i < std::min(kProposals, found->size()); ++i) {
    const auto& one = (*found)[i];
    if (console.json())
      console.object(forecastJson(one));
    else
      console.line(printed("  %-16s %5.0f s  ", spreadOf(quantitiesOf(one).front()).c_str(), one.duration_s) +
                   "probebox calibrate " + std::string{wanted.method->name()} + " " + chosenOf(one.wanted));
  }
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const Plan& options, const std::string&, Console& console) {
  const auto wanted = wantedOf(options);
  if (!wanted) return console.fail(wanted.error());
  const auto set_up = setUpOf(options);
  if (!set_up) return console.fail({ExitStatus::usage, "bad-description", set_up.error().what});
  if (options.time_s) return propose(*wanted, *set_up, options, console);
  const auto expected = plan::forecast(*wanted, *set_up);
  if (!expected) return console.fail({ExitStatus::failed, expected.error().name, expected.error().reason});
  if (console.json())
    console.object(forecastJson(*expected));
  else
    console.line(forecastPage(*expected));
  return ExitStatus::ok;
}

}  // namespace probebox::command
