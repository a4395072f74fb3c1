#pragma once
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/subject.hpp"

namespace probebox::metrology {

// Subject of a delay measured by driving along machine axes: "delay-x" where the record tells that of X alone,
// "delay-xy" of X and Y, "delay-oblique" where it tells that of no axis by itself, "delay" where it tells that of each
// axis, or has no axes.
std::optional<Subject> subjectOfDelay(const Dataset& dataset);

}  // namespace probebox::metrology
