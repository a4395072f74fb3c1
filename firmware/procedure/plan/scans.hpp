#pragma once
#include <optional>
#include <string>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Steps at which the stylus is led around the datum sphere in contact.
namespace probebox::procedure {

// The first depth of a scan, from its deepest: what the control may take the middle of the sphere to be off by (0.2 mm,
// docs/metrology.md A.7) must not take the contact away.
inline constexpr double kShallow = 0.5;

std::optional<Error> whyNoScans(const ProcedureOptions& with_defaults);
// One scan in either sense at every speed. path: without depths and sense, which come from the options.
void addScans(Plan& plan, const ProcedureOptions& with_defaults, const ScanPath& path);
std::string scanPrompt(const Step& step);

}  // namespace probebox::procedure
