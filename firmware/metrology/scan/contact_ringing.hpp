#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {

// One contact of a drive in and back, in both streams (docs/metrology.md A.8).
struct DrivenContact {
  const Signal* machine{};  // mm; must outlive this
  const Signal* probe{};    // raw
  double from{};            // stamps of the first and last deflected sample, probe time, s
  double until{};
  double machine_apex_s{};
  double kink_s{};  // time on either side of the apex that linear interpolation cannot follow
};

// Ringing of the stylus since contact: exp(-s/T) (a cos ws + b sin ws), s: time since the first deflected sample. w and
// T belong to the stylus, the amplitudes to each contact.
struct ContactRinging {
  double w{};      // rad/s
  double decay{};  // 1/T, 1/s
  std::vector<Eigen::Vector2d> amplitudes;

  // Columns for the ringing and for small errors of w and T, at times since the first deflected sample.
  Eigen::MatrixX4d shapes(const Eigen::ArrayXd& since) const;
};

// Finds the ringing; nullopt when the probe's signal beyond the machine's motion, delayed by tau_s, is only noise.
// tau_s: within a sample or two; its error is separated from the ringing. A bouncing stylus is in contact from its last
// touch on.
std::optional<ContactRinging> contactRinging(std::span<const DrivenContact> contacts, double tau_s);

// The probe's signal of a contact without the ringing.
Signal withoutContactRinging(const DrivenContact& contact, const ContactRinging& ringing,
                             const Eigen::Vector2d& amplitude);

}  // namespace probebox::metrology
