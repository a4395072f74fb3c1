#pragma once
#include <array>
#include <optional>

#include "firmware/procedure/plan/live_method.hpp"

// Facts that several live methods need.
namespace probebox::procedure {

extern const Fact kSphereDiameter;
extern const Fact kTiltingTable;
extern const Fact kSwivelHead;
extern const Fact kProbeLengths;
extern const Fact kSensorHead;

// Pairs of speeds, mm/s, that tell a delay from a size.
inline constexpr std::array<std::array<double, 2>, 6> kPairs{{{5, 20}, {10, 20}, {5, 40}, {10, 40}, {5, 60}, {10, 60}}};

// A sphere of known size: with the stylus ball it gives effective_diameter_mm.
void addSphereSize(metrology::Dataset& dataset, const Facts& facts);

// Takes axis and angles of B from their description.
void takeB(ProcedureOptions& options, const BFacts& b);
// Takes the numbers of the tools that carry the probe.
void takeTools(ProcedureOptions& options, const Facts& facts);

// Explains that the tool to be measured is not described; nullopt when it is.
std::optional<NotReady> whyUnknownTool(const ProcedureOptions& options, const Facts& facts);
// Refuses touches of a tool-setting device without a tool, or too short: the lines about each edge need travel at
// constant speed.
std::optional<Error> whyNoTool(const ProcedureOptions& options);

}  // namespace probebox::procedure
