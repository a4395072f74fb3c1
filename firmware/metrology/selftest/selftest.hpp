#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

// Checks a newly described box: every axis must count in the right direction by the right amount, and the probe must
// report the direction of a push. A wrong sign falsifies every calibration, and some of the wrong results look
// plausible.
namespace probebox::metrology {

// One row per step, with the tables of touches. travel_mm: of a jog of one axis along the row's normal (nx ny nz); 0: a
// push of the stylus along it.
inline constexpr MethodColumn kSelftestColumns[]{column::kTouch, column::given("travel_mm")};

// A push has at least so many rows of the free probe before it and after it, a jog so many at rest. A machine may start
// at once, so no more of the first are known to be at rest.
inline constexpr std::size_t kSelftestEndRows = 5;

// Outcome of one step.
struct Finding {
  bool good{};
  std::string name;  // name of an error for programs: "sense-wrong"; empty when good
  std::string what;  // one sentence for a person, with the remedy of an error
};

// Returns one finding per step, in their order. Config: "gain" (A3), the probe's described matrix. A jog is good when
// the axis moved by the travel within 2 % and no other by more than 0.2 mm. A push is good when the deflection is at
// least 0.05 mm and within 30 degrees of the push.
Outcome<std::vector<Finding>, Refusal> selftestFindings(const Dataset& dataset);

// moved_mm and deflected_mm: one row per step, columns X Y Z. Refuses what checkedTable() refuses, and by the name of
// the first bad finding, with all of them.
Outcome<Result, Refusal> solveSelftest(const Dataset& dataset);

extern const Method kSelftest;

}  // namespace probebox::metrology
