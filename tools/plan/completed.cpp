#include "tools/plan/completed.hpp"

#include <string>

#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/readiness.hpp"

namespace probebox::plan {
namespace {

using metrology::Refusal;

Refusal badOption(const std::string& what) {
  return {"bad-option", what};
}

}  // namespace

Outcome<ProcedureOptions, Refusal> completed(const Wanted& wanted, const procedure::Facts& facts,
                                             double deflection_limit_mm) {
  auto [method, options] = wanted;
  const auto by = procedure::readBy(options);
  if (!method->calibrates) {
    return Refusal{"not-forecast",
                   std::string{method->name()} + " has no result whose uncertainty could be forecast: run it"};
  }
  if (const auto why = procedure::whyNoY(*method, options, facts)) return Refusal{"not-forecast", why->what};
  if (by == procedure::ReadBy::head) {
    if (const auto why = procedure::whyNoHead(*method, facts)) return badOption(why->what);
  }
  if (by == procedure::ReadBy::shank) {
    if (const auto why = procedure::whyNoShank(*method, facts)) return badOption(why->what);
  }
  if (facts.trigger_probe) {
    if (const auto why = procedure::whyUnready(*method, facts, true, by)) return Refusal{"not-forecast", why->what};
  }
  if (options.turns != 0 && !method->takes_turns) {
    return Refusal{"bad-option", std::string{method->name()} + " has no option turns: omit it"};
  }
  if (options.contacts && !method->takes_contacts)
    return badOption(std::string{method->name()} + " takes no contacts by turning C: omit that option.");
  if (method->why_unfit != nullptr) {
    if (const auto why = method->why_unfit(options, facts)) return badOption(why->what);
  }
  const auto described = procedure::described(*method, options, facts, by);
  if (!described) return badOption(described.error().what);
  options = *described;
  if (const auto why = procedure::validate(*method, options, deflection_limit_mm)) return badOption(why->what);
  return options;
}

}  // namespace probebox::plan
