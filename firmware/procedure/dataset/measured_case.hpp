#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::procedure {

// What a run measured, as the case of its method: the same tables and keys, so that a saved run solves to the same
// digits. A reading of a ball is the centre of its touches with the delay in force taken out; the touches stay in the
// case as further tables. `refusal`: the readings could not be computed; the touches are there nevertheless.
struct RunDataset {
  metrology::Dataset dataset;
  std::optional<metrology::Refusal> refusal;
  std::vector<std::string> warnings;  // about what is not in the case
};

}  // namespace probebox::procedure
