#include "tools/plan/forecast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "firmware/procedure/plan/methods.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

using metrology::Estimate;
using metrology::Refusal;
using procedure::Method;

// The sd of a run scatters itself, by a few per cent: its degrees of freedom are the samples.
constexpr std::uint64_t kRuns = 4;

void addSquares(std::vector<Estimate>& sums, const std::vector<Estimate>& run) {
  for (std::size_t i = 0; i < sums.size(); ++i) {
    for (std::size_t k = 0; k < sums[i].sd.size(); ++k) sums[i].sd[k] += run[i].sd[k] * run[i].sd[k];
  }
}

std::vector<Estimate> squared(std::vector<Estimate> estimates) {
  for (auto& estimate : estimates) {
    for (double& sd : estimate.sd) sd *= sd;
  }
  return estimates;
}

bool turnsC(Method method) {
  return method == Method::centreline || method == Method::centreline_limited_access;
}

// Sets of speeds that tell a delay from a size, or repeat one speed.
std::vector<std::vector<double>> speedSets(Method method) {
  std::vector<std::vector<double>> sets;
  const auto repeated = [&](const std::vector<double>& base) {
    for (std::size_t times = 1; times * base.size() <= kMostSpeeds; ++times) {
      std::vector<double> set;
      for (std::size_t i = 0; i < times; ++i) set.insert(set.end(), base.begin(), base.end());
      sets.push_back(std::move(set));
    }
  };
  switch (method) {
    case Method::delay_multi_speed:
      for (const double fast : {20.0, 40.0, 60.0}) repeated({5, fast}), repeated({10, fast});
      repeated({5, 10, 20, 30, 40});
      break;
    case Method::delay_per_axis:
      for (const double fast : {20.0, 40.0, 60.0}) repeated({5, fast}), repeated({10, fast});
      break;
    case Method::delay_in_out:
      for (const double speed : {5.0, 10.0, 20.0}) repeated({speed});
      break;
    default:
      for (const double speed : {10.0, 25.0, 40.0, 60.0}) repeated({speed});
  }
  return sets;
}

std::vector<ProcedureOptions> candidates(Method method, const ProcedureOptions& given) {
  std::vector<ProcedureOptions> all{given};
  const auto spread = [&all](const auto& expand) {
    std::vector<ProcedureOptions> wider;
    for (const auto& options : all) expand(options, wider);
    all = std::move(wider);
  };
  if (given.speed_count == 0 && !procedure::readsBalls(method)) {
    spread([&](const ProcedureOptions& options, auto& wider) {
      for (const auto& speeds : speedSets(method)) {
        ProcedureOptions chosen = options;
        chosen.speed_count = static_cast<std::uint8_t>(speeds.size());
        std::ranges::copy(speeds, chosen.speeds_mm_s.begin());
        wider.push_back(chosen);
      }
    });
  }
  if (turnsC(method) && given.angles == 0) {
    spread([](const ProcedureOptions& options, auto& wider) {
      for (const std::uint16_t angles : std::array<std::uint16_t, 8>{3, 4, 6, 8, 12, 16, 24, 30}) {
        wider.push_back(options);
        wider.back().angles = angles;
      }
    });
  }
  const bool plate = method == Method::rotary_axis_errors;
  if ((method == Method::c_axis_alignment || plate) && given.balls == 0) {
    spread([plate](const ProcedureOptions& options, auto& wider) {
      for (std::uint16_t balls = plate ? 3 : 2; balls <= 7; ++balls) {
        wider.push_back(options);
        wider.back().balls = balls;
      }
    });
  }
  return all;
}

bool touchesOnly(const procedure::Plan& plan) {
  return std::ranges::all_of(std::span{plan.steps}.first(plan.step_count), [](const procedure::Step& step) {
    return step.kind == procedure::Kind::touch || step.kind == procedure::Kind::in_out;
  });
}

Refusal notForecast(Method method) {
  return {"not-forecast", std::string{procedure::nameOf(method)} +
                              " does more than touch, and its precision depends on the machine: run it"};
}

double firstSd(const Forecast& forecast) {
  const bool known = !forecast.estimates.empty() && !forecast.estimates.front().sd.empty();
  return known ? forecast.estimates.front().sd.front() : std::numeric_limits<double>::infinity();
}

Outcome<Forecast, Refusal> forecastOf(Method method, const ProcedureOptions& options, const SetUp& set_up,
                                      std::uint64_t runs) {
  if (method == Method::centreline_by_steps) {
    return Refusal{"not-forecast",
                   "the later steps of centreline-by-steps follow from earlier measurements: use the forecast of "
                   "centreline-limited-access, which reads the same ball"};
  }
  const bool does_more = procedure::needsOf(method) == procedure::Needs::screw || procedure::measuresATool(method) ||
                         procedure::needsHead(method);
  if (does_more) return notForecast(method);
  constexpr double kAnyLimit_mm = 100;  // whoever runs it looks at the probe's
  if (const auto why = procedure::whyRefused(method, options, kAnyLimit_mm)) return Refusal{"bad-option", why->what};
  const auto plan = std::make_unique<procedure::Plan>();  // large
  procedure::fill(*plan, method, options);
  if (!touchesOnly(*plan)) return notForecast(method);
  Forecast forecast{.method = method,
                    .options = options,
                    .touches = plan->step_count,
                    .duration_s = 0,
                    .estimates = {},
                    .dropped = {}};
  for (std::uint64_t run = 0; run < runs; ++run) {
    const auto simulated = simulatedRun(*plan, set_up, run + 1);
    if (!simulated.solved) return simulated.solved.error();
    forecast.duration_s = simulated.duration_s;
    if (run == 0) {
      forecast.estimates = squared(simulated.solved->estimates);
      forecast.dropped = simulated.solved->dropped;
    } else {
      addSquares(forecast.estimates, simulated.solved->estimates);
    }
  }
  for (auto& estimate : forecast.estimates) {
    for (double& sd : estimate.sd) sd = std::sqrt(sd / static_cast<double>(runs));
  }
  return forecast;
}

}  // namespace

Outcome<Forecast, Refusal> forecast(Method method, const ProcedureOptions& options, const SetUp& set_up) {
  return forecastOf(method, options, set_up, kRuns);
}

Outcome<std::vector<Forecast>, Refusal> proposals(Method method, const ProcedureOptions& options, const SetUp& set_up,
                                                  double time_s) {
  std::vector<Forecast> fitting;
  std::optional<Refusal> first;
  bool any = false;
  for (const auto& chosen : candidates(method, options)) {
    auto expected = forecastOf(method, chosen, set_up, 1);
    any = any || expected;
    if (!expected && !first) first = expected.error();
    if (expected && expected->duration_s <= time_s) fitting.push_back(std::move(expected).value());
  }
  if (!any && first) return *first;
  std::ranges::stable_sort(fitting, {}, firstSd);
  return fitting;
}

}  // namespace probebox::plan
