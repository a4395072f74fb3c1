#include "firmware/metrology/solve.hpp"

#include <string>
#include <utility>

#include "firmware/metrology/checks/checks.hpp"
#include "firmware/metrology/checks/likely_causes.hpp"
#include "firmware/metrology/checks/suspects.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/tool/tool_store.hpp"
#include "firmware/metrology/uncertainty/budget.hpp"
#include "protocol/units/nearest.hpp"

namespace probebox::metrology {

Solved solve(const Dataset& dataset, const Method& method) {
  for (const auto& check : checks()) {
    if (check.before == nullptr) continue;
    if (auto refusal = check.before(dataset, method)) return *std::move(refusal);
  }
  auto solved = withUncertainty(dataset, method, storedLength);
  if (!solved) return withLikelyCause(dataset, method, std::move(solved).error());
  TRY(const auto mended, mendFaults(dataset, method, solved.value()));
  if (mended.changed()) solved = solveMended(mended, method, storedLength);
  if (!solved) return solved;
  for (const auto& check : checks()) {
    if (check.after == nullptr) continue;
    if (auto refusal = check.after(dataset, method, solved.value())) return *std::move(refusal);
  }
  nameLikelyCauses(mended.dataset, method, solved.value());
  nameOtherUnits(mended.dataset, method, solved.value());
  if (method.judge == nullptr) return solved;
  if (auto refusal = method.judge(dataset, solved.value())) return *refusal;
  return solved;
}

Solved solve(const Dataset& dataset) {
  if (const Method* method = methodNamed(dataset.method)) return solve(dataset, *method);
  std::string known;
  for (const auto name : methods()) known += (known.empty() ? "" : ", ") + std::string{name};
  return Refusal{"unknown-method", "there is no method '" + dataset.method + "'" +
                                       didYouMean(dataset.method, methods()) + "; use one of: " + known};
}

std::vector<std::string_view> methods() {
  std::vector<std::string_view> names;
  for (const Method* method : allMethods()) names.push_back(method->name);
  return names;
}

}  // namespace probebox::metrology
