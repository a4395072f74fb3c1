#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <random>

#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

class Contact;

// Simulates the recording of the steps of a run.
class SimulatedRecording {
 public:
  SimulatedRecording(const SetUp& set_up, const procedure::Facts& facts, std::uint64_t seed);

  // False: the recording is full, as the box's would be.
  bool take(const procedure::Step& step);

  double duration() const;
  const capture::Recording& recording() const { return recording_; }
  capture::Scales scales() const;

 private:
  void stopAt(const procedure::Step& step);
  double stopOff(std::size_t axis);
  capture::Touch begin(const procedure::Step& step) const;
  bool end(capture::Touch touch, double duration_s);
  bool touch(const procedure::Step& step);
  void switches(capture::Touch& touch, const Contact& contact);
  bool hold(const procedure::Step& step);
  bool sweep(const procedure::Step& step);
  bool rest(const procedure::Step& step);
  bool scan(const procedure::Step& step);
  bool turn(const procedure::Step& step);
  bool machineRow(double t, const Eigen::Vector3d& position);
  bool probeRow(double t, const Eigen::Vector3d& channels_mm);
  bool driftRow(double t, double reading_um);
  Eigen::Vector3d surfaceOf(const procedure::Step& step) const;
  Eigen::Vector3d setterFaceOf(const procedure::Step& step) const;
  Eigen::Vector3d ballOf(const procedure::Step& step) const;
  Eigen::Vector3d tilted(const Eigen::Vector3d& ball, double angle_rad) const;
  Eigen::Vector3d firstTip() const;
  Eigen::Vector3d movedByHead(const Eigen::Vector3d& tip, double swivel_rad = 0) const;
  Eigen::Vector3d tipOf(const procedure::Step& step) const;
  Eigen::Vector3d noise(double sigma_um);
  double normal(double sigma);
  // Calls take(t) for each sample until it returns false, which it then returns: the recording is full.
  bool sample(double rate_hz, double duration_s, const auto& take);

  const SetUp& set_up_;
  const procedure::Facts& facts_;
  std::mt19937_64 random_;
  capture::Recording recording_;
  double now_s_;
  std::array<double, 3> pose_{};        // A, B, C of the last step, rad
  std::array<double, 3> beside_rad_{};  // by which their present stops are off; B: of the table
  double head_beside_rad_{};            // the same of the head
};

}  // namespace probebox::plan
