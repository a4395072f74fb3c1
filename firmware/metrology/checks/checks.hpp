#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// A fault that cases of any method may have. solve() looks for all of them; the table of docs/metrology.md lists them.
struct Check {
  std::string_view name;     // of the refusal, or of the fault that is warned of
  std::string_view applies;  // to which part of a case
  std::string_view about;    // what shows it, and what follows
  // Before the case is solved: refuses it.
  std::optional<Refusal> (*before)(const Dataset& dataset, const Method& method){};
  // Refuses the result, or adds a warning to it.
  std::optional<Refusal> (*after)(const Dataset& dataset, const Method& method, Result& result){};
};

// In the order in which they are made.
std::span<const Check> checks();

}  // namespace probebox::metrology
