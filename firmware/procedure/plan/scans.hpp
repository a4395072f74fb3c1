#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>

#include "firmware/procedure/plan/sides.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Steps at which the stylus is led around the datum sphere in contact.
namespace probebox::procedure {

// The first depth of a scan, from its deepest: what the control may take the middle of the sphere to be off by (0.2 mm,
// docs/metrology.md A.7) must not take the contact away.
inline constexpr double kShallow = 0.5;

// The deepest: the probe has to stay clear of its end though the control takes the middle of the sphere to be off.
inline constexpr double kScanDeep_mm = 0.6;

inline constexpr std::array kScanSpeeds{20.0, 40.0, 60.0};
inline constexpr std::array<std::span<const double>, 3> kScanSpeedSets{
    std::span{kScanSpeeds}.first(1), std::span{kScanSpeeds}.last(1), std::span{kScanSpeeds}};
inline constexpr ProcedureOptions kUsualScan =
    with(touchesAt(kScanSpeeds[0], kScanSpeeds[1], kScanSpeeds[2]),
         [](ProcedureOptions& options) { options.overtravel_mm = kScanDeep_mm; });

std::optional<Error> whyNoScans(const ProcedureOptions& with_defaults);
// One scan in either sense at every speed. path: without depths and sense, which come from the options.
void addScans(Plan& plan, const ProcedureOptions& with_defaults, const ScanPath& path);
std::string scanPrompt(const Step& step);

}  // namespace probebox::procedure
