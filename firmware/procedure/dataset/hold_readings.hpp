#pragma once
#include <Eigen/Core>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Builds the cases of methods whose steps are holds.
namespace probebox::procedure {

// Mean machine position and sensor readings of one hold, each with its sd.
struct Hold {
  const capture::TouchRequest* request{};
  Eigen::Vector3d at_mm, sd_at_mm;
  Eigen::Vector3d sensors, sd_sensors;
};

// A case with table holds, and tables machine and probe with every row; the method adds its own.
struct HeldRun {
  RunDataset run;
  std::vector<Hold> holds;
};
HeldRun holdDataset(const FinishedRun& run);

}  // namespace probebox::procedure
