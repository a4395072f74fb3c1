#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/touch/quantisation.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One stream of a touch under analysis. Touch and stream must outlive it.
struct Seen {
  const Touch& touch;
  const Stream& stream;
  std::string name;
  Eigen::Vector3d direction;  // of the motion
  Eigen::Vector3d steps;      // of the encoder or converter of each channel, 0 where there are none
  double noise{};             // deviation of one sample while it moves
  double usual_s{};           // between samples: the median
};

struct Window {
  Run offered;  // samples that may belong to the window
  Run trusted;  // those of them that contain almost no ramp
};

struct Steady {
  Line line;
  Rounding rounding;
  Run used;
  std::vector<std::string> spikes;
  Eigen::Matrix3d neighbours = Eigen::Matrix3d::Zero();  // neighbourProducts of the line
};

// Name of a sample: stream and stamp.
std::string stampOf(const std::string& stream, double time);

Refusal aboutTouch(const Touch& touch, std::string name, const std::string& what);

// Refuses too-few-samples (fewer than three) and gap (more than 40 % of the run, and more than two samples lost).
std::optional<Refusal> tooSparse(const Seen& seen, Run run);

// Fits a line to the window without ramps at its ends and without spikes. Also refuses speed-not-constant (2 %) and
// residual-too-large (slip or bounce: rms above three sd of a sample, or many spikes).
Outcome<Steady, Refusal> fitWindow(const Seen& seen, Window window);

}  // namespace probebox::metrology
