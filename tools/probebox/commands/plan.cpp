#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/messages/machine.hpp"
#include "tools/case/budget_names.hpp"
#include "tools/case/quantities.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/planned_machine.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kProposals = 5;  // proposals, on a page

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

Json forecastJson(const plan::Forecast& forecast, const PlannedMachine& machine) {
  Json sd = Json::object(), u = Json::object(), expanded = Json::object(), dropped = Json::array();
  Json quantities = Json::array();
  for (const auto& quantity : quantitiesOf(forecast)) {
    const auto text = [&](const std::optional<double>& value) {
      return value ? Json(casefolder::withUnit(quantity.label, *value)) : Json(nullptr);
    };
    quantities.push_back(
        {{"name", quantity.label.name}, {"sd", text(quantity.sd)}, {"expanded_k2", text(quantity.expanded)}});
    sd[quantity.key] = quantity.sd ? Json(*quantity.sd) : Json(nullptr);
    u[quantity.key] = quantity.expanded ? Json(*quantity.expanded / 2) : Json(nullptr);
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
          {"u", u},
          {"expanded_k2", expanded},
          {"quantities", quantities},
          {"in_u", forecast.in_u},
          {"taken_as_exact", forecast.taken_as_exact},
          {"dropped", dropped},
          {"machine", describe(machine)}};
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

std::string inputLine(const char* begin, const std::vector<std::string>& keys) {
  std::string all;
  for (const auto& key : keys) all += (all.empty() ? begin : ", ") + casefolder::budgetName(key);
  return all.empty() ? all : "\n  " + all;
}

std::string forecastPage(const plan::Forecast& forecast, const PlannedMachine& machine) {
  std::string all = std::string{forecast.wanted.method->name()} + ": " + stepsOf(forecast) +
                    printed(", about %.0f s", forecast.duration_s);
  for (const auto& quantity : quantitiesOf(forecast)) {
    all += printed("\n  %-22s ", quantity.label.name.c_str()) + printed("%-16s ", spreadOf(quantity).c_str());
    if (quantity.expanded) all += "U (k = 2) " + casefolder::withUnit(quantity.label, *quantity.expanded);
  }
  for (const auto& dropped : forecast.dropped) all += "\n  left out: " + dropped.name + ", " + dropped.reason;
  all += "\n  (+/- u, k = 1, of readings and descriptions)";
  all += inputLine("in u beside the readings: ", forecast.in_u);
  all += inputLine("not in u, taken as exact: ", forecast.taken_as_exact);
  for (const auto& line : inWords(machine)) all += "\n  " + line;
  return all;
}

// "--probe-rate 10, --acceleration 1"
std::string assumedBy(const Plan& options) {
  std::string all;
  const auto add = [&](const char* option, const std::optional<double>& value) {
    if (value) all += (all.empty() ? "" : ", ") + std::string{option} + printed(" %g", *value);
  };
  add("--machine-rate", options.machine_rate_hz);
  add("--machine-noise", options.machine_noise_um);
  add("--probe-rate", options.probe_rate_hz);
  add("--probe-noise", options.probe_noise_um);
  add("--switch-noise", options.switch_noise_um);
  add("--acceleration", options.acceleration_mm_s2);
  return all;
}

// Nothing was measured that could be measured again. What was assumed may be to blame.
std::string ofASimulation(std::string reason, const Plan& options) {
  const auto remedy = reason.rfind(';');
  if (remedy != std::string::npos && reason.find(" again", remedy) != std::string::npos) reason.erase(remedy);
  const auto assumed = assumedBy(options);
  return assumed.empty() ? reason : reason + " (assumed by " + assumed + ")";
}

// What the machine lacks may be why no run could be simulated.
Trouble troubleOf(const metrology::Refusal& refusal, const PlannedMachine& machine, const Plan& options) {
  const bool simulated = refusal.name != "bad-option" && refusal.name != "not-forecast";
  std::string reason = simulated ? ofASimulation(refusal.reason, options) : refusal.reason;
  if (!machine.why_refused.empty() && machine.why_refused != reason)
    reason += (reason.ends_with('.') ? " " : ". ") + std::string{"On that machine: "} + machine.why_refused;
  return {ExitStatus::failed, refusal.name, reason};
}

ExitStatus proposeRuns(const plan::Wanted& wanted, const PlannedMachine& machine, const Plan& options,
                       Console& console) {
  const auto found =
      plan::proposals(wanted, machine.set_up, *options.time_s, [&console] { return console.interrupted(); });
  if (console.interrupted()) return ExitStatus::interrupted;
  if (!found) return console.fail(troubleOf(found.error(), machine, options));
  if (found->empty())
    return console.fail(
        {ExitStatus::failed, "nothing-fits",
         printed("no set of touches that this method can use fits into %g s; allow more time", *options.time_s)});
  if (!console.json()) console.line(forecastPage(found->front(), machine));
  if (!console.json()) console.line("the most precise that fit into " + printed("%g s:", *options.time_s));
  for (std::size_t i = 0; i < std::min(kProposals, found->size()); ++i) {
    const auto& one = (*found)[i];
    if (console.json())
      console.object(forecastJson(one, machine));
    else
      console.line(printed("  %-16s %5.0f s  ", spreadOf(quantitiesOf(one).front()).c_str(), one.duration_s) +
                   "probebox calibrate " + std::string{wanted.method->name()} + " " + chosenOf(one.wanted));
  }
  return ExitStatus::ok;
}

// A box that is named is asked. A recording that PROBEBOX_URI names is none.
std::string boxOfPlan(const std::string& given) {
  const char* environment = std::getenv("PROBEBOX_URI");
  const std::string named = given.empty() && environment != nullptr ? environment : "";
  return !given.empty() ? given : named.starts_with("file:") ? std::string{} : named;
}

Outcome<std::optional<AskedBox>, Trouble> askedBox(const std::string& uri, const Console& console) {
  if (uri.empty()) return std::optional<AskedBox>{};
  TRY(const auto box, openBox(uri, console));
  auto says = ask<messages::DescribeMachine>(*box, console);
  if (says) return std::optional{AskedBox{.uri = uri, .says = std::move(says).value()}};
  auto trouble = says.error();
  if (trouble.name == messages::nameOf(messages::ErrorCode::unknown_operation))
    trouble.what += " Without it, give --machine FILE and no -u.";
  return trouble;
}

}  // namespace

ExitStatus planFor(const Plan& options, const std::optional<AskedBox>& box, Console& console) {
  const auto wanted = wantedOf(options);
  if (!wanted) return console.fail(wanted.error());
  const auto machine = plannedMachine(options, *wanted, box);
  if (!machine) return console.fail(machine.error());
  if (options.time_s) return proposeRuns(*wanted, *machine, options, console);
  const auto expected = [&] {
    const EndsAtOnce while_it_computes{console};
    return plan::forecast(*wanted, machine->set_up);
  }();
  if (console.interrupted()) return ExitStatus::interrupted;
  if (!expected) return console.fail(troubleOf(expected.error(), *machine, options));
  if (console.json())
    console.object(forecastJson(*expected, *machine));
  else
    console.line(forecastPage(*expected, *machine));
  return ExitStatus::ok;
}

ExitStatus run(const Plan& options, const std::string& uri, Console& console) {
  if (const auto wanted = wantedOf(options); !wanted) return console.fail(wanted.error());
  const auto box = askedBox(boxOfPlan(uri), console);
  return box ? planFor(options, *box, console) : console.fail(box.error());
}

}  // namespace probebox::command
