#include "firmware/metrology/uncertainty/budget.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"
#include "firmware/metrology/uncertainty/worst_determined.hpp"

namespace probebox::metrology {
namespace {

// In sd of the input: small, so that no reading is dropped or taken back on the way.
constexpr double kStep = 0.1;

std::vector<double> valuesOf(const Result& result) {
  std::vector<double> values;
  for (const auto& estimate : result.estimates) {
    values.insert(values.end(), estimate.values.begin(), estimate.values.end());
  }
  return values;
}

std::optional<std::vector<double>> valuesWith(const Dataset& dataset, Solver solver, const TypeBInput& input, double by,
                                              std::size_t count) {
  Dataset moved = dataset;
  input.move(moved, by);
  const auto solved = solver(moved);
  if (!solved) return std::nullopt;
  auto values = valuesOf(solved.value());
  return values.size() == count ? std::optional{std::move(values)} : std::nullopt;
}

// What one sd of the input changes the promised values by; one-sided where a limit is near.
Outcome<std::vector<double>, Refusal> effectOf(const Dataset& dataset, Solver solver, const TypeBInput& input,
                                               const std::vector<double>& here) {
  const auto above = valuesWith(dataset, solver, input, kStep, here.size());
  const auto below = valuesWith(dataset, solver, input, -kStep, here.size());
  if (!above && !below) {
    return Refusal{"no-convergence", "the effect of " + input.name +
                                         " cannot be evaluated: the case is refused when the value is changed by a "
                                         "tenth of it; omit the key, or look for readings at a limit"};
  }
  const double width = (above ? kStep : 0.0) + (below ? kStep : 0.0);
  const auto& high = above ? *above : here;
  const auto& low = below ? *below : here;
  std::vector<double> effect;
  for (std::size_t k = 0; k < here.size(); ++k) effect.push_back((high[k] - low[k]) / width);
  return effect;
}

// Inputs of one name are one line of the budget; they are independent.
void addToBudget(std::vector<Contribution>& budget, const std::string& name, const std::vector<double>& effect) {
  auto line = std::ranges::find(budget, name, &Contribution::name);
  if (line == budget.end()) {
    budget.push_back({.name = name, .type_b = true, .sd = std::vector<double>(effect.size(), 0.0)});
    line = budget.end() - 1;
  }
  for (std::size_t k = 0; k < effect.size(); ++k) line->sd[k] = std::hypot(line->sd[k], effect[k]);
}

bool allHaveSd(const Result& result) {
  return std::ranges::none_of(result.estimates, [](const Estimate& estimate) { return estimate.sd.empty(); });
}

// Type A: the method's sd without those inputs that it holds already. Where a part has no sd, it is left at nothing and
// that part gets no combined uncertainty.
Contribution readingsOf(const Result& result, const std::vector<double>& in_sd) {
  Contribution readings{.name = "readings", .type_b = false, .sd = {}};
  for (const auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      const double sd = estimate.sd.empty() ? 0.0 : estimate.sd[k];
      const double known = in_sd[readings.sd.size()];
      readings.sd.push_back(std::sqrt(std::max(sd * sd - known * known, 0.0)));
    }
  }
  return readings;
}

void addCombined(Result& result) {
  std::size_t k = 0;
  for (auto& estimate : result.estimates) {
    for (std::size_t part = 0; part < estimate.values.size(); ++part, ++k) {
      double squares = 0.0;
      for (const auto& line : result.budget) squares += line.sd[k] * line.sd[k];
      if (!estimate.sd.empty()) estimate.uncertainty.push_back(std::sqrt(squares));
    }
  }
}

// Behind what the solver itself has said: what no readings of this kind determine, then what these leave open.
void addUnobservable(Result& result, const Dataset& dataset, const Method& method) {
  result.unobservable.insert(result.unobservable.end(), method.unobservable.begin(), method.unobservable.end());
  if (method.undetermined == nullptr) return;
  if (auto sentence = method.undetermined(dataset)) result.unobservable.push_back(*std::move(sentence));
}

}  // namespace

Solved withUncertainty(const Dataset& dataset, const Method& method, StoreReader store) {
  TRY(const auto inputs, typeBInputs(dataset, method, store));
  const bool warm = dataset.config.contains("expansion_per_k");
  const Dataset at_hand = warm || !inputs.empty() ? atTemperature(dataset, method) : Dataset{};
  const Dataset& known = warm || !inputs.empty() ? at_hand : dataset;
  auto solved = method.solver(known);
  if (!solved) return solved;
  Result& result = solved.value();
  const auto here = valuesOf(result);
  std::vector<Contribution> type_b;
  std::vector<double> in_sd(here.size(), 0.0);
  for (const auto& input : inputs) {
    TRY(const auto effect, effectOf(known, method.solver, input, here));
    addToBudget(type_b, input.name, effect);
    for (std::size_t k = 0; input.in_sd && k < here.size(); ++k) in_sd[k] = std::hypot(in_sd[k], effect[k]);
  }
  if (allHaveSd(result) || !type_b.empty()) result.budget.push_back(readingsOf(result, in_sd));
  result.budget.insert(result.budget.end(), type_b.begin(), type_b.end());
  addCombined(result);
  if (result.covariance) result.weakest = weakestOf(*result.covariance);
  addUnobservable(result, dataset, method);
  result.conditions = conditionsOf(dataset);
  return solved;
}

}  // namespace probebox::metrology
