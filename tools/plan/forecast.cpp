#include "tools/plan/forecast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/capacity.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/rates.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

// Assumptions that no run could be made with, named before a solver speaks of touches that nobody has measured.

using metrology::Refusal;

std::unique_ptr<procedure::Plan> planOf(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                        const SetUp& set_up) {
  auto plan = std::make_unique<procedure::Plan>();  // large
  procedure::fill(*plan, method, options);
  procedure::takeReadings(*plan, procedure::probeKindOf(factsOf(set_up, options.tool)));
  return plan;
}

// What a box would refuse the run for at its start: too-few-samples by the rates of its sources, recording-full.
// options: completed; facts: of set_up.
std::optional<Refusal> whyUnsuited(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                   const procedure::Facts& facts, const SetUp& set_up) {
  const auto plan = planOf(method, options, set_up);
  procedure::Rates rates{.positions_hz = set_up.axis_rates_hz, .deflections_hz = set_up.probe_rate_hz};
  for (double& hz : rates.positions_hz) hz = hz > 0 ? hz : set_up.machine_rate_hz;
  if (const auto why = procedure::whyTooSlow(*plan, facts, rates)) return Refusal{"too-few-samples", why->what};
  if (const auto why = procedure::whyTooLongToRecord(*plan, rates)) return Refusal{"recording-full", why->what};
  return std::nullopt;
}

// Explains by the acceleration why a simulated run was refused; nullopt when it reaches its speeds in time.
std::optional<Refusal> whyTooSluggish(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                      const SetUp& set_up, const Refusal& refused) {
  const auto plan = planOf(method, options, set_up);
  for (std::size_t i = 0; i < plan->step_count; ++i) {
    const procedure::Step& step = plan->steps[i];
    if (step.kind != procedure::Kind::touch && step.kind != procedure::Kind::in_out) continue;
    const double speed = step.touch.retract_speed_mm_s, needed_mm = speed * speed / (2 * set_up.acceleration_mm_s2);
    const double given_mm = (1 - metrology::RetractNeeds::kHighest) * step.overtravel_mm;
    if (needed_mm <= given_mm) continue;
    std::array<char, 320> text{};
    std::snprintf(
        text.data(), text.size(),
        "at %g mm/s2 the machine needs %.3g mm to reach %g mm/s, and a touch has %.3g mm of its overtravel for "
        "it: state the acceleration of the machine (--acceleration), or choose a lower speed (--speed) or more "
        "overtravel (--overtravel)",
        set_up.acceleration_mm_s2, needed_mm, speed, given_mm);
    return Refusal{refused.name, text.data()};
  }
  return std::nullopt;
}

using metrology::Estimate;
using metrology::Refusal;
using procedure::LiveMethod;

// The sd of a run scatters itself, by a few per cent: its degrees of freedom are the samples.
constexpr std::uint64_t kRuns = 4;

// Root mean squares of sd and combined uncertainty over the runs that were added.
class MeanSpread {
 public:
  void add(const std::vector<Estimate>& run) {
    if (++runs_ == 1) sums_ = run;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      addSquares(run[i].sd, sums_[i].sd);
      addSquares(run[i].uncertainty, sums_[i].uncertainty);
    }
  }
  std::vector<Estimate> estimates() const {
    auto all = sums_;
    for (auto& estimate : all) {
      for (double& square : estimate.sd) square = std::sqrt(square / runs_);
      for (double& square : estimate.uncertainty) square = std::sqrt(square / runs_);
    }
    return all;
  }

 private:
  void addSquares(const std::vector<double>& values, std::vector<double>& sums) const {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] = (runs_ == 1 ? 0 : sums[k]) + values.at(k) * values.at(k);
  }

  std::vector<Estimate> sums_;
  double runs_{};
};

// The method's sets of speeds and their repeats; else one speed of several, and its repeats.
std::vector<std::vector<double>> speedSets(const LiveMethod& method) {
  std::vector<std::span<const double>> bases{method.speed_sets.begin(), method.speed_sets.end()};
  for (std::size_t i = 0; method.speed_sets.empty() && i < procedure::kSingles.size(); ++i)
    bases.push_back(std::span{procedure::kSingles}.subspan(i, 1));
  std::vector<std::vector<double>> sets;
  for (const auto base : bases) {
    std::vector<double> set;
    while (set.size() + base.size() <= kMostSpeeds) {
      set.insert(set.end(), base.begin(), base.end());
      sets.push_back(set);
    }
  }
  return sets;
}

// Replaces each run by those that differ from it in one thing.
void spread(std::vector<Wanted>& all, const auto& values, const auto& set) {
  std::vector<Wanted> wider;
  for (const auto& wanted : all) {
    for (const auto& value : values) {
      wider.push_back(wanted);
      set(wider.back(), value);
    }
  }
  all = std::move(wider);
}

std::vector<Wanted> candidates(const Wanted& given) {
  const auto& [method, options] = given;
  const bool holds = options.head || method->kind == procedure::Kind::hold;
  const bool reads_balls = method->finds_a_place && !method->takes_tool;
  std::vector<Wanted> all{given};
  if (options.speed_count == 0 && !holds && !reads_balls && !method->of_screw) {
    spread(all, speedSets(*method), [](Wanted& wanted, const std::vector<double>& speeds) {
      wanted.options.speed_count = static_cast<std::uint8_t>(speeds.size());
      std::ranges::copy(speeds, wanted.options.speeds_mm_s.begin());
    });
  }
  if (method->usual.angles != 0 && options.angles == 0) {
    spread(all, std::array<std::uint16_t, 8>{3, 4, 6, 8, 12, 16, 24, 30},
           [](Wanted& wanted, std::uint16_t angles) { wanted.options.angles = angles; });
  }
  if (method->usual.balls != 0 && options.balls == 0) {
    std::vector<std::uint16_t> counts;
    for (std::uint16_t count = method->fewest_balls; count <= 7; ++count) counts.push_back(count);
    spread(all, counts, [](Wanted& wanted, std::uint16_t balls) { wanted.options.balls = balls; });
  }
  if (method->takes_turns && options.turns == 0) {
    spread(all, std::array<std::uint16_t, 7>{3, 4, 6, 8, 10, 15, 20},
           [](Wanted& wanted, std::uint16_t turns) { wanted.options.turns = turns; });
  }
  return all;
}

double firstUncertainty(const Forecast& forecast) {
  if (forecast.estimates.empty()) return std::numeric_limits<double>::infinity();
  const auto& first = forecast.estimates.front();
  const auto& of_first = first.uncertainty.empty() ? first.sd : first.uncertainty;
  return of_first.empty() ? std::numeric_limits<double>::infinity() : of_first.front();
}

// Type B lines of the budget that contribute to any value.
std::vector<std::string> typeBOf(const metrology::Result& result) {
  std::vector<std::string> names;
  for (const auto& line : result.budget) {
    const bool counts = std::ranges::any_of(line.sd, [](double sd) { return sd > 0; });
    if (line.type_b && counts) names.push_back(line.name);
  }
  return names;
}

Outcome<Forecast, Refusal> forecastOf(const Wanted& wanted, const SetUp& set_up, std::uint64_t runs) {
  const auto facts = factsOf(withProbeFor(*wanted.method, set_up), wanted.options.tool);
  TRY(const auto options, completed(wanted, facts, set_up.deflection_limit_mm));
  if (auto refusal = whyUnsuited(*wanted.method, options, facts, set_up)) return *refusal;
  Forecast forecast{.wanted = wanted,
                    .steps = 0,
                    .duration_s = 0,
                    .estimates = {},
                    .also = {},
                    .axis = {},
                    .dropped = {},
                    .in_u = {},
                    .taken_as_exact = {}};
  MeanSpread spread;
  for (std::uint64_t run = 0; run < runs; ++run) {
    const auto simulated = simulatedRun(*wanted.method, options, set_up, run + 1);
    if (!simulated.solved)
      return whyTooSluggish(*wanted.method, options, set_up, simulated.solved.error())
          .value_or(simulated.solved.error());
    spread.add(simulated.solved->estimates);
    if (run > 0) continue;
    forecast.steps = simulated.steps;
    forecast.duration_s = simulated.duration_s;
    forecast.also = simulated.solved->also;
    forecast.axis = simulated.axis;
    forecast.dropped = simulated.solved->dropped;
    forecast.in_u = typeBOf(*simulated.solved);
    forecast.taken_as_exact = simulated.taken_as_exact;
  }
  forecast.estimates = spread.estimates();
  return forecast;
}

}  // namespace

Outcome<Forecast, Refusal> forecast(const Wanted& wanted, const SetUp& set_up) {
  return forecastOf(wanted, set_up, kRuns);
}

Outcome<std::vector<Forecast>, Refusal> proposals(const Wanted& wanted, const SetUp& set_up, double time_s,
                                                  const std::function<bool()>& stopped) {
  std::vector<Forecast> fitting;
  std::optional<Refusal> first;
  bool any = false;
  for (const auto& candidate : candidates(wanted)) {
    if (stopped()) break;
    const auto options = completed(candidate, factsOf(withProbeFor(*candidate.method, set_up), candidate.options.tool),
                                   set_up.deflection_limit_mm);
    if (options && shortestDuration(*candidate.method, *options, set_up) > time_s) {
      any = true;
      continue;
    }
    auto expected = forecastOf(candidate, set_up, 1);
    any = any || expected;
    if (!expected && !first) first = expected.error();
    if (expected && expected->duration_s <= time_s) fitting.push_back(std::move(expected).value());
  }
  if (!any && first) return *first;
  std::ranges::stable_sort(fitting, {}, firstUncertainty);
  return fitting;
}

}  // namespace probebox::plan
