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
inline constexpr std::string_view kNoRedundancy = "no-redundancy";
inline constexpr std::string_view kUnusualLength = "unusual-length";
inline constexpr std::string_view kUnusualScatter = "unusual-scatter";

// Name of the line of a drift in the budget.
inline constexpr std::string_view kDriftBudget = "drift of the readings";

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

// first: the solved case. Refuses x-in-diameters and angle-reversed, of which no answer can be made.
Outcome<Mended, Refusal> mendFaults(const Dataset& dataset, const Method& method, const Result& first);

// Solves a mended case, and adds what was done to the answer.
Solved solveMended(const Mended& mended, const Method& method, StoreReader store);

// The refusal of a case for its residuals, by the name of the fault without which it is solved, if there is one.
Refusal withLikelyCause(const Dataset& dataset, const Method& method, Refusal refusal);

// Warns of an answer that no reading checks.
std::optional<Refusal> warnOfNoRedundancy(const Dataset& dataset, const Method& method, Result& result);

// Warns, where no sigma is stated that could be compared with, of readings that scatter more than those of a machine
// tool.
std::optional<Refusal> warnOfUnusualScatter(const Dataset& dataset, const Method& method, Result& result);

// Warns of promised lengths that a machine tool seldom has, such as inches (Quantity::usual).
std::optional<Refusal> warnOfUnusualLengths(const Dataset& dataset, const Method& method, Result& result);

}  // namespace probebox::metrology
