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

// The head that swivels, as machine.toml describes it.
struct SwivelConfig {
  bool fitted{};
  RotaryAxis axis{RotaryAxis::b};
  bool by_angle{};  // what the readings have left at each angle is added too: an index error of the axis
  Nanoseconds hold{std::chrono::seconds{5}};
};

// What a swivelling head adds to the command: + E(B, L) (docs/metrology.md, (F1)). It needs a result in force, the
// angle of its axis, and the length of the tool in the spindle.
class SwivelSource {
 public:
  explicit SwivelSource(const SwivelConfig& config);

  // Says why a result cannot come into force; nothing for one that can.
  static std::optional<Error> whyUnfit(const SwivelConfig& config, const SwivelActivated& activated,
                                       std::span<const Event> rows);

  void push(const SwivelActivated& activated);
  void push(const ErrorsAtAngle& row);
  void tick(const MachineTick& tick);
  void doubtful(MonoTime now) {
    if (config_.fitted) held_.doubtful(now);
  }

  const HeldSource& held() const { return held_; }
  bool fitted() const { return config_.fitted; }
  RotaryAxis axis() const { return config_.axis; }
  std::uint64_t resultId() const { return result_id_; }  // in force; 0: none

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
