#include "firmware/procedure/plan/plan.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include "firmware/procedure/plan/methods.hpp"
#include "tools/case/readable.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kShown = 5;  // proposals, on a page

ProcedureOptions optionsOf(const Plan& options) {
  constexpr double kRadPerDegree = std::numbers::pi / 180;
  ProcedureOptions chosen{.speed_count = static_cast<std::uint8_t>(options.speeds_mm_s.size()),
                          .speeds_mm_s = {},
                          .overtravel_mm = options.overtravel_mm.value_or(0),
                          .clearance_mm = options.clearance_mm.value_or(0),
                          .approach_rad = options.approach_deg.value_or(0) * kRadPerDegree,
                          .arc_rad = options.arc_deg.value_or(0) * kRadPerDegree,
                          .angles = options.angles.value_or(0),
                          .balls = options.balls.value_or(0)};
  std::ranges::copy(options.speeds_mm_s, chosen.speeds_mm_s.begin());
  return chosen;
}

plan::SetUp setUpOf(const Plan& options) {
  plan::SetUp set_up;
  const auto take = [](double& value, const std::optional<double>& given) { value = given.value_or(value); };
  take(set_up.machine_rate_hz, options.machine_rate_hz);
  take(set_up.machine_noise_um, options.machine_noise_um);
  take(set_up.probe_rate_hz, options.probe_rate_hz);
  take(set_up.probe_noise_um, options.probe_noise_um);
  take(set_up.acceleration_mm_s2, options.acceleration_mm_s2);
  return set_up;
}

std::string chosenOf(const plan::Forecast& forecast) {
  std::string text;
  const auto& options = forecast.options;
  for (std::size_t i = 0; i < options.speed_count; ++i)
    text += printed("%s%g", i == 0 ? "--speed " : ",", options.speeds_mm_s[i]);
  const auto add = [&](const char* flag, double value) {
    if (value != 0) text += printed("%s%s %g", text.empty() ? "" : " ", flag, value);
  };
  add("--overtravel", options.overtravel_mm);
  add("--clearance", options.clearance_mm);
  add("--approach", options.approach_rad * 180 / std::numbers::pi);
  add("--arc", options.arc_rad * 180 / std::numbers::pi);
  add("--angles", options.angles);
  add("--heights", options.balls);
  return text;
}

// "+/- 1.9 us" of one component.
std::string spreadOf(const metrology::Estimate& estimate, std::size_t component) {
  const auto label = casefolder::labelOf(estimate.key);
  if (estimate.sd.empty()) return "+/- ?";
  return printed("+/- %.2g %s", estimate.sd[component] * label.factor, label.unit.c_str());
}

std::string keyOf(const metrology::Estimate& estimate, std::size_t component) {
  if (estimate.shape == metrology::Shape::scalar) return estimate.key;
  return estimate.key + "[" + std::to_string(component) + "]";
}

Json describe(const plan::Forecast& forecast) {
  Json sd = Json::object(), expanded = Json::object(), dropped = Json::array();
  for (const auto& estimate : forecast.estimates) {
    for (std::size_t i = 0; i < estimate.values.size(); ++i) {
      sd[keyOf(estimate, i)] = estimate.sd.empty() ? Json(nullptr) : Json(estimate.sd[i]);
      expanded[keyOf(estimate, i)] = estimate.sd.empty() ? Json(nullptr) : Json(2 * estimate.sd[i]);
    }
  }
  for (const auto& one : forecast.dropped) dropped.push_back({{"name", one.name}, {"reason", one.reason}});
  const auto& options = forecast.options;
  const std::vector<double> speeds{options.speeds_mm_s.begin(), options.speeds_mm_s.begin() + options.speed_count};
  return {{"method", procedure::nameOf(forecast.method)},
          {"options", chosenOf(forecast)},
          {"speeds_mm_s", speeds},
          {"angles", options.angles},
          {"balls", options.balls},
          {"touches", forecast.touches},
          {"duration_s", forecast.duration_s},
          {"sd", sd},
          {"expanded_k2", expanded},
          {"dropped", dropped}};
}

std::string page(const plan::Forecast& forecast) {
  std::string all = printed("%s: %zu touches, about %.0f s", std::string{procedure::nameOf(forecast.method)}.c_str(),
                            forecast.touches, forecast.duration_s);
  for (const auto& estimate : forecast.estimates) {
    for (std::size_t i = 0; i < estimate.values.size(); ++i) {
      const auto label = casefolder::labelOf(estimate.key);
      const std::string component = estimate.shape == metrology::Shape::scalar ? "" : "[" + std::to_string(i) + "]";
      all += printed("\n  %-22s ", (label.name + component).c_str()) + printed("%-16s", spreadOf(estimate, i).c_str());
      if (!estimate.sd.empty())
        all += printed("U (k = 2) %.2g %s", 2 * estimate.sd[i] * label.factor, label.unit.c_str());
    }
  }
  for (const auto& dropped : forecast.dropped) all += "\n  left out: " + dropped.name + ", " + dropped.reason;
  return all;
}

ExitStatus propose(procedure::Method method, const Plan& options, Console& console) {
  const auto found = plan::proposals(method, optionsOf(options), setUpOf(options), *options.time_s);
  if (!found) return console.fail({ExitStatus::failed, found.error().name, found.error().reason});
  if (found->empty())
    return console.fail(
        {ExitStatus::failed, "nothing-fits",
         printed("no set of touches that this method can use fits into %g s; allow more time", *options.time_s)});
  if (!console.json()) console.line(page(found->front()));
  if (!console.json()) console.line("the most precise that fit into " + printed("%g s:", *options.time_s));
  for (std::size_t i = 0; i < std::min(kShown, found->size()); ++i) {
    const auto& one = (*found)[i];
    if (console.json())
      console.object(describe(one));
    else
      console.line(printed("  %-16s %5.0f s  ", spreadOf(one.estimates.front(), 0).c_str(), one.duration_s) +
                   "probebox calibrate " + std::string{procedure::nameOf(method)} + " " + chosenOf(one));
  }
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const Plan& options, const std::string&, Console& console) {
  const auto method = procedure::methodNamed(options.method);
  if (!method) {
    std::string known;
    for (const auto name : procedure::methodNames()) known += (known.empty() ? "" : ", ") + std::string{name};
    return console.fail(usage("no box runs " + options.method + "; use one of: " + known));
  }
  if (options.speeds_mm_s.size() > kMostSpeeds)
    return console.fail(usage("a run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some"));
  if (options.time_s) return propose(*method, options, console);
  const auto expected = plan::forecast(*method, optionsOf(options), setUpOf(options));
  if (!expected) return console.fail({ExitStatus::failed, expected.error().name, expected.error().reason});
  if (console.json())
    console.object(describe(*expected));
  else
    console.line(page(*expected));
  return ExitStatus::ok;
}

}  // namespace probebox::command
