#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

// The first look at a box on a machine: does every axis count the right way and as much as it moves, and does the probe
// say the direction in which its stylus is pushed? A wrong sign in a description makes every calibration wrong, and
// some of them believable.
namespace probebox::metrology {

// One row a step beside the tables of touches. travel_mm: of a jog of one axis alone, along the row's normal (nx ny
// nz); 0: a push of the stylus along it.
inline constexpr std::string_view kSelftestColumns[]{"touch", "travel_mm"};

// What one step showed.
struct Finding {
  bool good{};
  std::string name;  // of what is wrong, for programs: "sense-wrong"; empty when good
  std::string what;  // one sentence, for a person, with the remedy where something is wrong
};

// One finding a step, in the order of the steps. Config: "gain" (A3), the probe's matrix as it is described.
// A jog is good when the axis moved by the travel within 2 %, and no other by more than 0.2 mm. A push is good when the
// deflection, which has to be 0.05 mm at least, points within 30 degrees of where the stylus was pushed.
Outcome<std::vector<Finding>, Refusal> selftestFindings(const Dataset& dataset);

// moved_mm and deflected_mm: one row a step, columns X Y Z, in the order of the steps. Refuses what checkedTable()
// refuses, and by the name of the first finding that is not good, with all of them.
Outcome<Result, Refusal> solveSelftest(const Dataset& dataset);

}  // namespace probebox::metrology
