#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

// Results in force, and what is proposed, for faces that show their values. Replaced as a whole when one of them
// changes.
namespace probebox::published {

struct ServedValue {
  std::string key;  // as the method calls it: "centre_mm"
  std::vector<double> values;
  std::vector<double> sd;  // combined, k = 1; empty: none
};

struct ServedResult {
  std::string subject{};
  std::uint64_t result_id{};
  std::uint32_t probe_tool{};
  bool rests_on_retired{};
  std::vector<ServedValue> values{};
};

struct ServedResults {
  std::vector<ServedResult> in_force;
  std::vector<ServedResult> proposed{};  // the newest check, where it is newer than the one in force
};

// State of the last request about runs and results that came over one line of a controller.
struct ControllerRequestState {
  std::uint16_t answered{};  // commit number
  std::uint16_t outcome{};   // 0 none, 1 in hand, 2 done, 3 refused
  std::uint16_t refusal{};   // code
  std::uint32_t number{};    // run or result
  bool waits{};              // accepted, until the cut is over
};

// Sizes and places of features, from the descriptions and results in force.
struct KnownFeatures {
  double sphere_reach_mm{};  // from the centre of the datum sphere to that of the stylus' ball at contact; 0: unknown
  // Likewise from the middle of the plates across X, Y, Z, of the datum cylinder, and of the datum cube along X, Y, Z;
  // negative where surfaces look inwards.
  std::array<double, 3> plates_reach_mm{};
  double cylinder_reach_mm{};
  std::array<double, 3> cube_reach_mm{};
  double stylus_radius_mm{};
  std::array<double, 3> setter_half_width_mm{};
  bool has_setter{};
  bool has_setter_place{};
  std::array<double, 3> setter_mm{};
};

struct LineState {
  std::uint16_t boots{};
  std::uint16_t calibration_refusal{};
  ControllerRequestState controller_request;
  KnownFeatures features;
  std::uint16_t due{};  // subjects that are overdue or were never measured
};

}  // namespace probebox::published
