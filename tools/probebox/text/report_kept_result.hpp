#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/messages/control.hpp"
#include "tools/probebox/cli/console.hpp"

// Formats one stored result for programs and for people.
namespace probebox::command {

// Values by key with sd (k = 1), u (k = 1, type B included) and expanded_k2, covariance (row by row, in the products of
// the units; null where it is not known), fit, budget, warnings, dropped readings, unobservable quantities.
Json describe(const metrology::Result& result, std::string_view axis);
Json describe(const metrology::Refusal& refusal);

// Values about the subject first.
std::string page(const metrology::Result& result, std::string_view subject);

// "in force", "waits for the end of the cut", "proposed", "retired", "refused"; "not in force here" for one of another
// probe, machine or mounting than the box describes now, and for one that does not fit what it describes.
std::string standingOf(const messages::ResultSummary& summary);
// A sentence for each result that it was computed with, and whether that one is still in force.
std::vector<std::string> restsOnInWords(const messages::ResultSummary& summary);
// Who said that a case, which names no machine, was measured here.
std::string adoptedBy(const std::string& person);
// Number, method, subject, state, who accepted it and when, and its probe, machine and mounting.
std::string headOf(const messages::ResultSummary& summary);

}  // namespace probebox::command
