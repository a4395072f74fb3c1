#pragma once
#include <array>

#include "firmware/corrections/held_source.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

struct CentrelineConfig {
  std::array<double, 2> assumed_mm{};         // where the control takes the turning axis to be, X Y
  std::array<bool, 2> corrected{true, true};  // false for an axis that does not exist, such as Y on many lathes
  Nanoseconds hold{std::chrono::seconds{5}};
};

// Computes the correction of the spindle axis as a function of Z: c(Z) - c_assumed, mm (docs/metrology.md, F).
class CentrelineSource {
 public:
  explicit CentrelineSource(const CentrelineConfig& config) : config_{config}, held_{config.hold} { held_.invalid(); }

  void push(const CentrelineActivated& activated) { in_force_ = activated; }
  void tick(const MachineTick& tick);

  static constexpr auto kKind = SourceKind::centreline;
  const HeldSource& held() const { return held_; }
  static constexpr bool fitted() { return true; }
  static constexpr SourceInputs inputs() { return {.positions = {false, false, true}, .angles = {}}; }
  bool calibrated() const { return in_force_.result_id != 0; }
  const CentrelineActivated& inForce() const { return in_force_; }
  // Centre at this Z; all in mm.
  std::array<double, 2> centreAt(double z_mm) const;

 private:
  CentrelineConfig config_;
  HeldSource held_;
  CentrelineActivated in_force_;
};

}  // namespace probebox::corrections
