#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {

// One contact of a drive in and straight back, in both streams (docs/metrology.md A.8).
struct DrivenContact {
  const Signal* machine{};  // mm; they outlive it
  const Signal* probe{};    // raw
  double from{};            // stamps of the first and last deflected sample, probe time, s
  double until{};
  double machine_apex_s{};
  double kink_s{};  // on either side of the apex, that lines between samples cannot follow
};

// What rings in the stylus from the moment of contact: exp(-s/T) (a cos ws + b sin ws), s the time since the first
// deflected sample. w and T are the stylus' own, the amplitudes belong to each contact.
struct ContactRinging {
  double w{};      // rad/s
  double decay{};  // 1/T, 1/s
  std::vector<Eigen::Vector2d> amplitudes;

  // Columns that it and small errors of w and T look like, for times since the first deflected sample.
  Eigen::MatrixX4d shapes(const Eigen::ArrayXd& since) const;
};

// Nothing where what the probe shows beyond the machine's motion, seen tau_s later, is no more than noise. tau_s: to
// within a sample or two; what it is off by is told from the ringing. A stylus that leaves the surface again is in
// contact from its last touch on.
std::optional<ContactRinging> contactRinging(std::span<const DrivenContact> contacts, double tau_s);

// The probe's signal of a contact without it.
Signal withoutContactRinging(const DrivenContact& contact, const ContactRinging& ringing,
                             const Eigen::Vector2d& amplitude);

}  // namespace probebox::metrology
