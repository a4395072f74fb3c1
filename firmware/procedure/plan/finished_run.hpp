#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

struct LiveMethod;

// A run whose steps are all recorded: the input from which its method builds the case.
struct FinishedRun {
  const LiveMethod& method;
  const capture::Recording& recording;
  const capture::Scales& scales;
  const Facts& facts;
};

// The case of a run, with the tables and keys of its method, so a saved run solves to the same digits. A ball reading
// is the centre of its touches, corrected by the delay in force; the touches are kept as further tables. refusal: why
// the readings could not be computed; the dataset then holds the touches only.
struct RunDataset {
  metrology::Dataset dataset;
  std::optional<metrology::Refusal> refusal;
  std::vector<std::string> warnings;  // about data that are not in the case
};

}  // namespace probebox::procedure
