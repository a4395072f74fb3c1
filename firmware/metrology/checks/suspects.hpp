#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"

// Ordinary faults of readings, found by solving again without them: a reading that is off, a drift in the order of the
// readings, X in diameters, an angle that counts the other way. Each is told where an F test on the residuals leaves
// chance less than 1e-5. Only faults in the rows that Result::residuals names, in mm, are sought.
namespace probebox::metrology {

// Stable names that begin a warning.
inline constexpr std::string_view kReadingLeftOut = "reading-left-out";
inline constexpr std::string_view kReadingsDrift = "readings-drift";
// And of a refusal.
inline constexpr std::string_view kLengthsInInches = "lengths-in-inches";

// The case without its faults.
struct Mended {
  Dataset dataset;
  std::map<std::string, std::set<std::size_t>> left_out;  // by table, numbers of rows in the file, from 0
  std::vector<Dropped> dropped;
  std::vector<TypeBInput> drift;  // uncertainty of the drift that was taken out
  std::vector<Estimate> rates;    // of that drift, where times are stated
  std::vector<std::string> warnings;

  bool changed() const { return !warnings.empty() || !drift.empty(); }
};

// first: the solved case. Refuses x-in-diameters, angle-reversed and lengths-in-inches, of which no answer can be made.
Outcome<Mended, Refusal> mendFaults(const Dataset& dataset, const Method& method, const Result& first);

// Solves a mended case, and adds what was done to the answer.
Solved solveMended(const Mended& mended, const Method& method, StoreReader store);

// Adds to a warning about residuals with which unit or sign they are gone. dataset: as it was solved.
void nameOtherUnits(const Dataset& dataset, const Method& method, Result& result);

// The refusal of a case, by the name of the unit or sign with which it is solved, if there is one; where its residuals
// refuse it, with the readings or the drift without which it is solved, and with likely causes.
Refusal withLikelyCause(const Dataset& dataset, const Method& method, Refusal refusal);

}  // namespace probebox::metrology
