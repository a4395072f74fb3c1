#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "firmware/procedure/plan/live_method.hpp"

// Facts that several live methods need.
namespace probebox::procedure {

extern const Fact kSphereDiameter;
extern const Fact kTiltingTable;
extern const Fact kSwivelHead;
extern const Fact kProbeLengths;
extern const Fact kSensorHead;
extern const Fact kTriggerProbe;

// Why a touch-trigger probe cannot run a method of the delay.
inline constexpr std::string_view kNoDelayOfTrigger =
    "measures the delay of a probe's samples, and a touch-trigger probe delivers none: no method with it needs that "
    "delay, because the ways in and out of every touch cancel it; pre-travel shows how late its switch is.";

// Pairs of speeds, mm/s, that separate a delay from a size.
inline constexpr std::array<std::array<double, 2>, 6> kPairs{{{5, 20}, {10, 20}, {5, 40}, {10, 40}, {5, 60}, {10, 60}}};
// Of runs whose delay one speed tells, too, where lost motion is known.
inline constexpr std::array kSingles{10.0, 25.0, 40.0, 60.0};
inline constexpr std::array kTenAndTwentyFive{10.0, 25.0};
inline constexpr std::array<std::span<const double>, 5> kSinglesAndPairs{
    std::span{kSingles}.subspan(1, 1), std::span{kSingles}.subspan(3, 1), kTenAndTwentyFive, kPairs[3], kPairs[5]};

// Adds for the record which diameter of the stylus ball a case relies on, and whether its sd is as stated, or it is
// assumed to be exact, where none is stated.
void addStylusBall(metrology::Dataset& dataset, const Facts& facts);

// Adds stylus_ball_diameter_mm and its sd, where it is stated; and addStylusBall().
void addStylusBallSize(metrology::Dataset& dataset, const Facts& facts);
// Adds the certified size of a feature under its key, its sd under "sd_" and that key, and addStylusBallSize().
void addGaugeSize(metrology::Dataset& dataset, const std::string& key, const std::optional<KnownSize>& size,
                  const Facts& facts);

// Adds effective_diameter_mm: diameters of the sphere and of the stylus ball, if the sphere's is known; the sd of each
// that states one, and the temperature.
void addEffectiveDiameter(metrology::Dataset& dataset, const Facts& facts);
// The same, and for the record the stylus ball and the sphere's certificate.
void addSphereSize(metrology::Dataset& dataset, const Facts& facts);

// Takes the distance of the stylus ball from the middle of the datum sphere at contact.
Outcome<ProcedureOptions> withReach(ProcedureOptions options, const Facts& facts);

// Takes axis and angles of B from their description.
void takeB(ProcedureOptions& options, const BFacts& b);
// Takes the numbers of the tools that carry the probe.
void takeTools(ProcedureOptions& options, const Facts& facts);

// Explains that a stylus ball between two plates, or in a bore, would run into the opposite side on its way out: the
// gap has to be wider than ball, clearance and run-out together. nullopt when it is.
std::optional<Error> whyTooNarrow(double gap_mm, double stylus_ball_mm, double clearance_mm);
// Explains that the tool to be measured is not described; nullopt when it is.
std::optional<NotReady> whyUnknownTool(const ProcedureOptions& options, const Facts& facts);
// Refuses touches of a tool-setting device without a tool, or too short: the lines about each edge need travel at
// constant speed.
std::optional<Error> whyNoTool(const ProcedureOptions& options);

}  // namespace probebox::procedure
