#include "firmware/procedure/plan/plan.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
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

plan::SetUp setUpOf(const Plan& options) {
  plan::SetUp set_up;
  const auto take = [](double& value, const std::optional<double>& given) { value = given.value_or(value); };
  take(set_up.machine_rate_hz, options.machine_rate_hz);
  take(set_up.machine_noise_um, options.machine_noise_um);
  take(set_up.probe_rate_hz, options.probe_rate_hz);
  take(set_up.probe_noise_um, options.probe_noise_um);
  take(set_up.acceleration_mm_s2, options.acceleration_mm_s2);
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
  return "+/- " + (quantity.sd ? casefolder::withUnit(quantity.label, *quantity.sd) : "?");
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
  return all;
}

ExitStatus propose(const plan::Wanted& wanted, const Plan& options, Console& console) {
  const auto found = plan::proposals(wanted, setUpOf(options), *options.time_s);
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
  if (options.time_s) return propose(*wanted, options, console);
  const auto expected = plan::forecast(*wanted, setUpOf(options));
  if (!expected) return console.fail({ExitStatus::failed, expected.error().name, expected.error().reason});
  if (console.json())
    console.object(forecastJson(*expected));
  else
    console.line(forecastPage(*expected));
  return ExitStatus::ok;
}

}  // namespace probebox::command
