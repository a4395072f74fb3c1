#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::procedure {

// The case of a run, with the tables and keys of its method, so a saved run solves to the same digits. A ball reading
// is the centre of its touches, corrected by the delay in force; the touches are kept as further tables. `refusal`: the
// readings could not be computed; the touches are still there.
struct RunDataset {
  metrology::Dataset dataset;
  std::optional<metrology::Refusal> refusal;
  std::vector<std::string> warnings;  // about data that are not in the case
};

}  // namespace probebox::procedure
