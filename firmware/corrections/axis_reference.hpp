#pragma once
#include <cstdint>
#include <optional>

#include "firmware/corrections/travel.hpp"
#include "firmware/latch/latch.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

using published::Homing;
using published::ReferenceFault;

// How the counts of an axis become a machine position.
enum class ReferenceBy : std::uint8_t {
  absolute,  // the encoder reports the position itself
  index,     // the axis passes its reference mark
  homing,    // the controller reports the position
};

struct ReferenceConfig {
  ReferenceBy by{ReferenceBy::homing};
  double mm_per_count{1};   // with the axis sense in its sign
  bool has_mark{};          // at a known place: pulses of another are not used
  double index_mm{};        // machine position where the mark begins for an axis that moves up
  double index_width_mm{};  // it begins this much higher for an axis that moves down
  double index_pitch_mm{};  // marks repeat at this distance; 0: there is one
  double index_tolerance_mm{0.02};
  double maximum_speed_mm_s{1000};  // of the axis; faster is an error of the encoder
  Travel travel{};
};

// The reference of one axis; for a rotary axis read degrees wherever mm is written. There is none until the first count
// of an absolute encoder, the index pulse or a position from the controller, and none after a count error. Counts lag
// behind the lines by the system delay (A1), so a mark is looked up in the counts that come that much later; while the
// delay is not known, marks that are passed fast are ignored. A count that was latched at the pulse needs no delay.
class AxisReference {
 public:
  // Longest delay that is assumed where a mark gives the reference while none has been measured.
  static constexpr double kUnknownDelay_s = 0.01;
  // While no delay has been measured, a mark is not judged as wrong for what the longest one explains that samples can
  // have.
  static constexpr double kLongestDelay_s = 1e-9 * static_cast<double>(latch::kLongestDelay.count());
  // Uncertainty of the edge of the index line relative to the trigger line that the delay was measured with.
  static constexpr double kEdgeUncertainty_s = 50e-6;
  // An axis that moved less than this in the last 100 ms stands still.
  static constexpr double kStill_mm = 0.01;
  // Without a count for longer than this it may have moved.
  static constexpr Nanoseconds kSilence = std::chrono::milliseconds{250};

  explicit AxisReference(const ReferenceConfig& config) : config_{config} {}

  void setDelay(double tau_s, double sd_s);
  void push(MonoTime at, std::int64_t counts);
  // latched_counts: those at the pulse, where the counter itself latches them.
  void index(MonoTime at, std::optional<std::int64_t> latched_counts = {});
  // Returns false and changes nothing if the axis cannot be homed at `now`, or cannot be at this position.
  bool homed(double position_mm, MonoTime now);
  Homing homing(MonoTime now) const;
  // An absolute encoder references its axis again with the next count, and goes on where counts were only missed.
  void encoderLost(bool is_gone = true);

  bool referenced() const { return offset_mm_.has_value(); }
  // Machine position at the latest count; nothing without a reference.
  std::optional<double> position_mm() const;
  // Machine position at any count of this axis; nothing without a reference.
  std::optional<double> position_mm(double counts) const;
  // Machine position at count 0; nothing without a reference. Of an absolute encoder it is known while that is away.
  std::optional<double> zero_mm() const { return config_.by == ReferenceBy::absolute ? 0.0 : offset_mm_; }
  // The latest count times mm_per_count; 0 before the first.
  double counted_mm() const { return u_mm_; }
  // Tests whether the axis is as fast as this.
  bool canMove(double way_mm, double in_s) const;
  // Tests whether no count has come for so long.
  bool isSilent(MonoTime now, Nanoseconds longer_than) const { return !has_count_ || now - at_ > longer_than; }
  ReferenceFault lastFault() const { return last_fault_; }
  std::uint32_t losses() const { return losses_; }
  // How often counts were found not to go on from those before, with or without a reference. Those of an absolute
  // encoder do.
  std::uint32_t breaks() const { return breaks_; }
  std::uint32_t unusedIndexes() const { return unused_indexes_; }  // passed too fast, two at once, of unknown place

 private:
  void dropReference(ReferenceFault fault);
  struct Pulse {
    MonoTime at{};
    std::optional<double> latched_mm;
  };
  void takeIndex(const Pulse& pulse, double moved_mm, double dt_s, MonoTime at, double u_mm);
  void followPass(MonoTime at, double u_mm);
  void passIndex(double u_mm, double speed_mm_s, double uncertainty_mm);
  double nearestIndex_mm(double position_mm, double speed_mm_s) const;

  ReferenceConfig config_;
  double tau_s_{};
  double delay_uncertainty_s_{kUnknownDelay_s};
  std::optional<double> offset_mm_;
  bool has_count_{};
  MonoTime at_{};
  double u_mm_{};  // counts times mm_per_count
  // Where the axis was at least 100 ms ago, and the one that will take its place.
  struct Anchor {
    MonoTime at{};
    double u_mm{};
    double sum_mm{};  // of how far the counts since were from it
    int counts{};
  };
  std::optional<Anchor> still_since_, next_anchor_;
  std::optional<Pulse> pending_index_;
  // A mark that was passed while the delay is not known: the counts of that moment come later.
  struct Pass {
    double u_mm{};
    double gone_mm{};   // in kUnknownDelay_s
    double reach_mm{};  // how far the counts have gone from there
    MonoTime due{};
  };
  std::optional<Pass> pass_;
  ReferenceFault last_fault_{};
  std::uint32_t losses_{};
  std::uint32_t breaks_{};
  std::uint32_t unused_indexes_{};
};

}  // namespace probebox::corrections
