#pragma once
#include <cstdint>
#include <optional>

#include "firmware/published/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

using published::ReferenceFault;

// How the counts of an axis become machine positions.
enum class ReferenceBy : std::uint8_t {
  absolute,  // the encoder reports absolute positions
  index,     // the axis passes its reference mark
  homing,    // the controller says where the axis stands
};

struct ReferenceConfig {
  ReferenceBy by{ReferenceBy::homing};
  double mm_per_count{1};   // with the axis sense in its sign
  double index_mm{};        // machine position where the mark begins for an axis that moves up
  double index_width_mm{};  // an axis moving down meets the mark this much higher
  double index_pitch_mm{};  // distance between reference marks; 0 for a single mark
  double index_tolerance_mm{0.02};
  double maximum_speed_mm_s{1000};  // maximum speed of the axis; faster counts are an encoder error
};

// Holds the reference of one incremental axis (for a rotary axis read degrees for mm). There is none until the index
// pulse or a homing message, and none after a count error. Counts lag behind edges by the system delay (A1), so the
// mark is looked up in counts that arrive this much later. While the delay is unknown, marks passed at high speed are
// ignored.
class AxisReference {
 public:
  // Largest possible system delay before it is calibrated.
  static constexpr double kUnknownDelay_s = 0.01;
  // Uncertainty of the index edge relative to the trigger edge that the delay was measured with.
  static constexpr double kEdgeUncertainty_s = 50e-6;
  // An axis is at standstill when it moved less than this in the last 100 ms.
  static constexpr double kStill_mm = 0.01;

  explicit AxisReference(const ReferenceConfig& config);

  void setDelay(double tau_s, double sd_s);
  void push(MonoTime at, std::int64_t counts);
  void index(MonoTime at);
  // Returns false and changes nothing when the axis is not at standstill or has an absolute encoder.
  bool homed(double position_mm);
  void encoderLost() { lose(ReferenceFault::encoder_lost); }

  bool referenced() const { return offset_mm_.has_value(); }
  // Machine position at the latest count; nullopt without a reference.
  std::optional<double> position_mm() const;
  // Machine position at any count of this axis.
  std::optional<double> position_mm(double counts) const;
  ReferenceFault lastFault() const { return last_fault_; }
  std::uint32_t losses() const { return losses_; }
  std::uint32_t unusedIndexes() const { return unused_indexes_; }  // marks passed too fast, or two marks at once

 private:
  void lose(ReferenceFault fault);
  void takeIndex(MonoTime due, double moved_mm, double dt_s, MonoTime at, double u_mm);
  void followPass(MonoTime at, double u_mm);
  void passIndex(double u_mm, double speed_mm_s, double uncertainty_mm);
  double nearestIndex_mm(double position_mm, double speed_mm_s) const;

  ReferenceConfig config_;
  double tau_s_{};
  double delay_uncertainty_s_{kUnknownDelay_s};
  std::optional<double> offset_mm_;
  bool has_count_{};
  MonoTime at_{};
  double u_mm_{};  // counts * mm_per_count
  // Position at least 100 ms ago, and the candidate that will replace it.
  struct Anchor {
    MonoTime at{};
    double u_mm{};
    double sum_mm{};  // sum of the distances of later counts from it
    int counts{};
  };
  std::optional<Anchor> still_since_, next_anchor_;
  std::optional<MonoTime> pending_index_;
  // A mark that was passed while the delay is unknown: its counts arrive within kUnknownDelay_s.
  struct Pass {
    double u_mm{};
    double reach_mm{};  // travel of the counts since then
    MonoTime until{};
  };
  std::optional<Pass> pass_;
  ReferenceFault last_fault_{};
  std::uint32_t losses_{};
  std::uint32_t unused_indexes_{};
};

}  // namespace probebox::corrections
