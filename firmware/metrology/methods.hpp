#pragma once
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/method.hpp"

namespace probebox::metrology {

// The methods that solve() knows, in alphabetical order.
std::span<const Method* const> allMethods();

// Nothing where there is no method of that name.
const Method* methodNamed(std::string_view name);

// Solves by a method that need not be among them, as solve() does.
Solved solve(const Dataset& dataset, const Method& method);

// What the results of such a case are about: "delay", "screw-x", "tool-4"; of a method that says none, or a case that
// does not say which, the method's name.
std::string subjectOf(const Dataset& dataset);

}  // namespace probebox::metrology
