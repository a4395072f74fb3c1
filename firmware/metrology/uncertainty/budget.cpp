#include "firmware/metrology/uncertainty/budget.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"
#include "firmware/metrology/uncertainty/machine_errors.hpp"
#include "firmware/metrology/uncertainty/worst_determined.hpp"

namespace probebox::metrology {
namespace {

// In sd of the input: small, so that no reading is dropped or taken back on the way.
constexpr double kStep = 0.1;
// Shares of an sd: a contribution that a person is told of, and one that counts at all.
constexpr double kTold = 0.1, kCounts = 1e-3;

std::vector<double> valuesOf(const Result& result) {
  std::vector<double> values;
  for (const auto& estimate : result.estimates) {
    values.insert(values.end(), estimate.values.begin(), estimate.values.end());
  }
  return values;
}

// The case solved with an input a little above and below; one of them where a limit is near.
struct Neighbours {
  std::optional<Result> above, below;
  double width{};  // from the lower to the higher one, in sd of the input
};

std::optional<Result> solvedWith(const Dataset& dataset, Solver solver, const TypeBInput& input, double by,
                                 std::size_t count) {
  Dataset moved = dataset;
  input.move(moved, by);
  auto solved = solver(moved);
  if (!solved || valuesOf(solved.value()).size() != count) return std::nullopt;
  return std::move(solved).value();
}

// What touches that lie elsewhere leave of the result, to first order.
Result withTouchesMoved(Result result, const std::vector<double>& outwards_mm) {
  for (auto* list : {&result.estimates, &result.also}) {
    for (auto& estimate : *list) {
      if (estimate.per_shift.size() != estimate.values.size() * outwards_mm.size()) continue;
      auto per_shift = estimate.per_shift.begin();
      for (double& value : estimate.values)
        for (const double outwards : outwards_mm) value += *per_shift++ * outwards;
    }
  }
  return result;
}

// They are of no further use.
void forgetTouches(Result& result) {
  result.touched = {};
  for (auto* list : {&result.estimates, &result.also})
    for (auto& estimate : *list) estimate.per_shift.clear();
}

// One of them is enough for an error whose effect is proportional to it.
Neighbours neighbourOf(const Dataset& dataset, Solver solver, const TypeBInput& input, std::size_t count) {
  Neighbours found;
  for (const double by : {input.whole_step ? 1.0 : kStep, kStep, -kStep}) {
    found.above = solvedWith(dataset, solver, input, by, count);
    found.width = by;
    if (found.above) break;
  }
  return found;
}

Outcome<Neighbours, Refusal> neighboursOf(const Dataset& dataset, Solver solver, const TypeBInput& input,
                                          const Result& result) {
  if (!input.outwards_mm.empty())
    return Neighbours{.above = withTouchesMoved(result, input.outwards_mm), .below = {}, .width = 1};
  const std::size_t count = valuesOf(result).size();
  if (input.of_machine) return neighbourOf(dataset, solver, input, count);
  Neighbours found{.above = solvedWith(dataset, solver, input, kStep, count),
                   .below = solvedWith(dataset, solver, input, -kStep, count)};
  found.width = (found.above ? kStep : 0.0) + (found.below ? kStep : 0.0);
  if (found.above || found.below) return found;
  const bool is_stated = input.warning.empty();
  return Refusal{"no-convergence", "the effect of " + input.name +
                                       " cannot be evaluated: the case is refused when the value is changed by a "
                                       "tenth of it; " +
                                       (is_stated ? "omit the key" : "record more digits") +
                                       ", or look for readings at a limit"};
}

// Change of the values for one sd of the input.
std::vector<double> changeOf(const std::vector<double>& here, const std::vector<double>& high,
                             const std::vector<double>& low, double width) {
  std::vector<double> change;
  for (std::size_t k = 0; k < here.size(); ++k) change.push_back((high[k] - low[k]) / width);
  return change;
}

// The name of each value in the covariance.
std::vector<std::string> namesOf(const Result& result) {
  std::vector<std::string> names;
  for (const auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      std::string name = estimate.key;
      if (estimate.shape == Shape::vector) name += "[" + std::to_string(k) + "]";
      if (estimate.shape == Shape::matrix)
        name += "[" + std::to_string(k / estimate.columns) + "][" + std::to_string(k % estimate.columns) + "]";
      names.push_back(std::move(name));
    }
  }
  return names;
}

void widenCovariance(Result& result, const std::vector<double>& effect) {
  if (!result.covariance) return;
  auto& [components, values] = *result.covariance;
  const auto names = namesOf(result);
  std::vector<double> of_component;
  for (const auto& component : components) {
    const auto at = std::ranges::find(names, component);
    of_component.push_back(at == names.end() ? 0.0 : effect[static_cast<std::size_t>(at - names.begin())]);
  }
  const std::size_t n = components.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) values[i * n + k] += of_component[i] * of_component[k];
  }
}

// Change of the parts of one estimate for one sd of the input; nothing for parts that a neighbour lacks.
std::vector<double> changeOf(const Estimate& estimate, const Neighbours& beside) {
  const auto valuesIn = [&](const std::optional<Result>& neighbour) {
    const auto* found = neighbour ? neighbour->find(estimate.key) : nullptr;
    return found != nullptr && found->values.size() == estimate.values.size() ? found->values : estimate.values;
  };
  return changeOf(estimate.values, valuesIn(beside.above), valuesIn(beside.below), beside.width);
}

// A value that measures an error has no allowance for it.
bool measures(const Method& method, const Estimate& estimate, const TypeBInput& input) {
  const auto* quantity = quantityOf(method, estimate.key);
  return quantity != nullptr && quantity->measures.error != nullptr && quantity->measures.error->key == input.name;
}

// Change of all promised values for one sd of the input.
std::vector<double> effectOf(const Method& method, const TypeBInput& input, const Result& result,
                             const Neighbours& beside) {
  const auto here = valuesOf(result);
  auto effect = changeOf(here, beside.above ? valuesOf(*beside.above) : here,
                         beside.below ? valuesOf(*beside.below) : here, beside.width);
  auto part = effect.begin();
  for (const auto& estimate : result.estimates) {
    const auto next = part + std::ssize(estimate.values);
    if (measures(method, estimate, input)) std::fill(part, next, 0.0);
    part = next;
  }
  return effect;
}

// Takes an error that all readings share into every sd, also of what is not promised, and into the covariance.
void widen(Result& result, const Neighbours& beside, const std::vector<double>& effect) {
  widenCovariance(result, effect);
  for (auto* list : {&result.estimates, &result.also}) {
    for (auto& estimate : *list) {
      const auto change = changeOf(estimate, beside);
      for (std::size_t k = 0; k < estimate.sd.size(); ++k) estimate.sd[k] = std::hypot(estimate.sd[k], change[k]);
    }
  }
}

// Type B part of what is not promised, of inputs that no sd holds. Squares of each part, in the order of Result::also.
using Squares = std::vector<std::vector<double>>;

void addSquares(Squares& squares, const Method& method, const Result& result, const Neighbours& beside,
                const TypeBInput& input) {
  squares.resize(result.also.size());
  for (std::size_t at = 0; at < result.also.size(); ++at) {
    if (measures(method, result.also[at], input)) continue;
    const auto change = changeOf(result.also[at], beside);
    squares[at].resize(change.size());
    for (std::size_t k = 0; k < change.size(); ++k) squares[at][k] += change[k] * change[k];
  }
}

// The combined uncertainty of what is not promised and has an sd.
void combineAlso(Result& result, Squares squares) {
  for (std::size_t at = 0; at < squares.size(); ++at) {
    auto& estimate = result.also[at];
    squares[at].resize(estimate.values.size());
    for (std::size_t k = 0; k < estimate.sd.size(); ++k)
      estimate.uncertainty.push_back(std::sqrt(estimate.sd[k] * estimate.sd[k] + squares[at][k]));
  }
}

// Whether an input adds more than this share of it to the sd of a promised value.
bool matters(const std::vector<double>& effect, const Result& result, double share) {
  std::size_t at = 0;
  for (const auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k, ++at) {
      if (!estimate.sd.empty() && std::abs(effect[at]) > share * estimate.sd[k]) return true;
    }
  }
  return false;
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

Solved withUncertainty(const Dataset& dataset, const Method& method, StoreReader store,
                       std::span<const TypeBInput> further) {
  TRY(auto inputs, typeBInputs(dataset, method, store));
  TRY(auto errors, machineErrors(dataset, method));
  inputs.insert(inputs.end(), further.begin(), further.end());
  std::ranges::move(errors, std::back_inserter(inputs));
  const bool warm = isWarm(dataset);
  const Dataset at_hand = warm || !inputs.empty() ? atTemperature(dataset, method) : Dataset{};
  const Dataset& known = warm || !inputs.empty() ? at_hand : dataset;
  auto solved = method.solver(known);
  if (!solved) return solved;
  Result& result = solved.value();
  std::ranges::move(touchErrors(known, method, result.touched), std::back_inserter(inputs));
  const auto here = valuesOf(result);
  std::vector<Contribution> type_b;
  std::vector<double> in_sd(here.size(), 0.0);
  Squares of_also;
  std::vector<std::string> assumed;
  for (const auto& input : inputs) {
    TRY(const auto beside, neighboursOf(known, method.solver, input, result));
    if (!beside.above && !beside.below) {
      auto warning = "U holds no " + input.name +
                     ": the case is refused where the readings are moved by that; look for readings at a limit";
      if (std::ranges::find(result.warnings, warning) == result.warnings.end())
        result.warnings.push_back(std::move(warning));
      continue;
    }
    const auto effect = effectOf(method, input, result, beside);
    if (!input.warning.empty()) {
      if (!matters(effect, result, kTold)) continue;
      result.warnings.push_back(input.warning);
    }
    if (input.of_machine) {
      addSquares(of_also, method, result, beside, input);
      if (!matters(effect, result, kCounts)) continue;
      if (input.is_assumed && matters(effect, result, kTold)) assumed.push_back(input.name);
      addToBudget(type_b, input.name, effect);
      continue;
    }
    addToBudget(type_b, input.name, effect);
    if (input.widens) widen(result, beside, effect);
    const bool in = input.in_sd || input.widens;
    if (!in) addSquares(of_also, method, result, beside, input);
    for (std::size_t k = 0; in && k < here.size(); ++k) in_sd[k] = std::hypot(in_sd[k], effect[k]);
  }
  if (allHaveSd(result) || !type_b.empty()) result.budget.push_back(readingsOf(result, in_sd));
  result.budget.insert(result.budget.end(), type_b.begin(), type_b.end());
  addCombined(result);
  combineAlso(result, std::move(of_also));
  forgetTouches(result);
  if (result.covariance) result.weakest = worstDeterminedOf(*result.covariance);
  addUnobservable(result, dataset, method);
  result.conditions = conditionsOf(dataset);
  if (auto sentence = assumedAccuracy(assumed))
    result.conditions.push_back({std::string{kAccuracyAssumed}, *std::move(sentence)});
  return solved;
}

}  // namespace probebox::metrology
