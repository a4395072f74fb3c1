#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

// All subjects that a result of the case may answer, subjectOf() first.
struct NamedSubject {
  std::string name;
  std::string_view needs;  // key of a value without which the result does not answer it; empty: none
};
std::vector<NamedSubject> subjectsOf(const Dataset& dataset);

// Whether a method names this subject, numbers and letters aside.
bool isSubject(std::string_view name);

}  // namespace probebox::metrology
