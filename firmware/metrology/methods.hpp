#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/method.hpp"

namespace probebox::metrology {

// The methods that solve() knows, in alphabetical order.
std::span<const Method* const> allMethods();

// Null if there is no method of that name.
const Method* methodNamed(std::string_view name);

// Description of the value of this key, by any method; null if no method describes it.
const Quantity* quantityOf(std::string_view key);

// Solves as solve() does, by a method that need not be in the list.
Solved solve(const Dataset& dataset, const Method& method);

// Subject of the results of such a case: "delay", "screw-x", "tool-4"; the method's name if the method has no subject
// or the case does not determine it.
std::string subjectOf(const Dataset& dataset);

// All subjects that a result of the case may answer, subjectOf() first.
std::vector<NamedSubject> subjectsOf(const Dataset& dataset);

}  // namespace probebox::metrology
