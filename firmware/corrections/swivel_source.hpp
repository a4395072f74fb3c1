#pragma once
#include <optional>
#include <span>

#include "firmware/corrections/held_source.hpp"
#include "firmware/corrections/incoming_table.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "firmware/metrology/live/swivel_correction.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::corrections {

// The swivelling head as described in machine.toml.
struct SwivelConfig {
  bool fitted{};
  RotaryAxis axis{RotaryAxis::b};
  bool by_angle{};  // also add the residuals of the readings by angle: an index error of the axis
  Nanoseconds hold{std::chrono::seconds{5}};
};

// Computes the correction of a swivelling head: + E(B, L), mm (docs/metrology.md, (F1)). Needs a result in force, the
// angle of its axis, and the tool length.
class SwivelSource {
 public:
  explicit SwivelSource(const SwivelConfig& config);

  // Explains why a result cannot come into force; nullopt when it can.
  static std::optional<Error> validateActivation(const SwivelConfig& config, const SwivelActivated& activated,
                                                 std::span<const Event> rows);

  void push(const SwivelActivated& activated);
  void push(const ErrorsAtAngle& row);
  void tick(const MachineTick& tick);

  static constexpr auto kKind = SourceKind::swivel;
  const HeldSource& held() const { return held_; }
  bool fitted() const { return config_.fitted; }
  SourceInputs inputs() const;
  std::uint64_t resultId() const { return result_id_; }  // result in force; 0: none

 private:
  void bringIntoForce(const std::optional<metrology::AngleTable<3>>& left);

  SwivelConfig config_;
  HeldSource held_;
  SwivelActivated coming_;
  IncomingTable<3> table_;
  std::uint64_t result_id_{};
  metrology::SwivelCorrection correction_{metrology::SwivelTerms{}};
};

}  // namespace probebox::corrections
