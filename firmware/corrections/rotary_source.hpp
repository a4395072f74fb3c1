#pragma once
#include <array>
#include <optional>
#include <span>

#include "firmware/corrections/held_source.hpp"
#include "firmware/corrections/incoming_table.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "firmware/metrology/live/rotary_correction.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::corrections {

// The rotary table as described in machine.toml.
struct RotaryConfig {
  std::size_t count{};                                    // of the axes; 0: there is no such table
  std::array<RotaryAxis, kRotaryAxes> chain{};            // from the base outwards
  std::array<metrology::Between, kRotaryAxes> between{};  // A, B, C
  bool at_tip{};                                          // the tool's length moves the point that is corrected
  Vector tool_direction{0, 0, -1};                        // from the spindle to the tip
  double measured_length_mm{};                            // of the tool that the axes were measured with
  Nanoseconds hold{std::chrono::seconds{5}};

  bool fitted() const { return count > 0; }
  bool turnsBy(RotaryAxis axis) const;
};

// Computes the correction for the errors of the table's axes at the tool position: + [delta + eps x p] over all links
// (docs/metrology.md, (F2)). Needs a result in force for every axis, all angles, all positions and, for the tool tip,
// the tool length.
class RotarySource {
 public:
  explicit RotarySource(const RotaryConfig& config);

  // Explains why a result cannot come into force; nullopt when it can.
  static std::optional<Error> validateActivation(const RotaryConfig& config, const RotaryActivated& activated,
                                                 std::span<const Event> rows);

  void push(const RotaryActivated& activated);
  void push(const ErrorsAtAngle& row);
  void tick(const MachineTick& tick);

  static constexpr auto kKind = SourceKind::rotary;
  const HeldSource& held() const { return held_; }
  bool fitted() const { return config_.fitted(); }
  SourceInputs inputs() const;
  const RotaryConfig& config() const { return config_; }
  // The result in force about the axis; result_id 0: none.
  const RotaryActivated& inForce(RotaryAxis axis) const { return axes_[static_cast<std::size_t>(axis)].in_force; }
  // Errors at an angle: mm along and rad about X, Y, Z. nullopt outside the measured angles.
  std::optional<metrology::SixErrors> errorsAt(RotaryAxis axis, std::optional<double> angle_rad) const;

 private:
  // The result that is arriving, and the one in force.
  struct AxisErrors {
    RotaryActivated coming;
    IncomingTable<6> table;
    RotaryActivated in_force;
    metrology::CalibratedAxis calibrated;
  };

  void chainUp();
  Eigen::Vector3d toolPoint(const MachineTick& tick) const;

  RotaryConfig config_;
  HeldSource held_;
  std::array<AxisErrors, kRotaryAxes> axes_;
  std::optional<metrology::RotaryCorrection> correction_;  // nullopt unless every axis has a result in force
};

}  // namespace probebox::corrections
