#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/corrections/axis_reference.hpp"
#include "firmware/corrections/centreline_source.hpp"
#include "firmware/corrections/inhibit_lines.hpp"
#include "firmware/corrections/output.hpp"
#include "firmware/corrections/rotary_angle.hpp"
#include "firmware/corrections/rotary_source.hpp"
#include "firmware/corrections/screw_source.hpp"
#include "firmware/corrections/served.hpp"
#include "firmware/corrections/swivel_source.hpp"
#include "firmware/corrections/tool_in_spindle.hpp"
#include "firmware/corrections/trigger_log.hpp"
#include "firmware/latch/record.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::corrections {

using published::CorrectionsState;
using published::Ledger;

struct CorrectionsConfig {
  std::array<ReferenceConfig, kLinearAxes> references{};
  std::array<OutputLimits, kLinearAxes> limits{};
  std::array<ScrewConfig, kLinearAxes> screws{};
  CentrelineConfig centreline{};
  std::array<RotaryAngleConfig, kRotaryAxes> angles{};
  ToolsConfig tools{};
  SwivelConfig swivel{};
  RotaryConfig rotary{};
  std::uint16_t mask{};         // sources that are summed after the start
  std::size_t inhibit_lines{};  // that give their level after the start
};

// Names the first value that is out of range and its valid range; nullopt when the configuration is valid.
std::optional<Error> validate(const CorrectionsConfig& config);

// Explains why a result cannot come into force under this configuration; nullopt when it can.
std::optional<Error> validateActivation(const CorrectionsConfig& config, std::span<const Event> result);

// Computes what the CNC reads from the results in force and the events. Starts with valid = 0. A source without its
// inputs is invalid, never zero. A doubtful source keeps its last value for T_hold, then the output is frozen and not
// valid.
class Corrections {
 public:
  // Heartbeat period of the register map.
  static constexpr Nanoseconds kHeartbeat = std::chrono::milliseconds{100};
  // A source that needs an axis is in doubt when its encoder was silent for this long.
  static constexpr Nanoseconds kSilence = AxisReference::kSilence;
  // Counts take the place of samples that did not come for this long: the probe is silent in every cut.
  static constexpr Nanoseconds kSamplesMissing = std::chrono::milliseconds{50};

  // config: must pass validate().
  explicit Corrections(const CorrectionsConfig& config);

  void push(const Count& count);
  void push(const AngleCount& count);
  // Index, trigger and inhibit lines. latched_counts: the axis's at an index pulse, where its counter latches them.
  void push(const Edge& edge, std::optional<std::int64_t> latched_counts = {});
  void push(const Drift& drift) { screws_[static_cast<std::size_t>(drift.axis)].push(drift); }
  void push(const SourceLost& lost);
  void push(const AxisHomed& homed);
  void push(const DelayActivated& activated);
  void push(const CentrelineActivated& activated) { centreline_.push(activated); }
  void push(const ScrewActivated& activated) { screws_[static_cast<std::size_t>(activated.axis)].push(activated); }
  void push(const SwivelActivated& activated) { swivel_.push(activated); }
  void push(const RotaryActivated& activated) { rotary_.push(activated); }
  void push(const ErrorsAtAngle& row) { swivel_.push(row), rotary_.push(row); }
  void push(const ScrewReferenceActivated& activated) {
    screws_[static_cast<std::size_t>(activated.axis)].push(activated);
  }
  void push(const ToolLengthActivated& activated) { tool_.activate(activated); }
  void push(const PoseTold& pose);
  void push(const CutInhibit& inhibit);
  // From now on an inhibit line whose level has not come counts as a cut; before the first advance() at the latest.
  void awaitInhibitLines();
  // Told before anything is served, it is in the first snapshot.
  void push(const AppliedRestored& applied);
  void push(const ServableWithin& bounds) { output_.keepWithin(bounds.least_mm, bounds.greatest_mm); }
  void push(const SourcesEnabled& enabled);

  // Takes the first record of a tick; `at` is its time.
  void tick(const latch::Record& record, MonoTime at);
  // Advances ages and heartbeats, and publishes the snapshot: values that the CNC reads change here only. The heartbeat
  // stops when neither records nor counts arrive.
  void advance(MonoTime now, const TickMap& map, const Ledger& ledger);

  const CorrectionsState& state() const { return state_; }
  // Returns triggers in order, each as soon as the machine position at it is known.
  std::optional<TriggerStamp> nextTrigger() { return triggers_.next(); }
  std::uint32_t nextTriggerNumber() const { return triggers_.nextNumber(); }
  const AxisReference& reference(std::size_t axis) const { return references_[axis]; }
  const AxisReference& reference(RotaryAxis axis) const { return angles_[static_cast<std::size_t>(axis)].reference(); }
  const ScrewSource& screw(std::size_t axis) const { return screws_[axis]; }
  // Angle of the last latch of an encoder; nullopt without one or its reference.
  std::optional<double> latched_rad(RotaryAxis axis) const {
    return angles_[static_cast<std::size_t>(axis)].latched_rad();
  }
  // Correction for screw expansion at the present position, nm, from the last valid extension, whether it is summed or
  // not. 0 for an axis without a screw or a reference; nullopt when the extension is older than T_hold.
  std::optional<std::int32_t> screw_nm(Axis axis, MonoTime now) const;
  // Returns the factors and offsets that turn counts into positions of the tool now. References are as of the latest
  // count; tool and angles as last published.
  published::ToolInSamples toolInSamples(MonoTime now) const;

 private:
  struct Sum {
    Vector value_mm{};
    bool any_invalid{};
    bool any_held{};
    std::array<Health, kSourceKinds> health{};
  };

  MachineTick machineTick(MonoTime at) const;
  void tickByCounts(MonoTime now);
  void runSources(MachineTick& tick, const Vector& u_mm, double smoothing);
  Sum sum() const;
  void include(Sum& sum, SourceKind kind, const HeldSource& source) const;
  bool sums(SourceKind kind) const { return (mask_ & bitOf(kind)) != 0; }
  // All sources: whatever is done with each follows from this list.
  static void forEachSource(auto& self, auto&& act) {
    for (auto& screw : self.screws_) act(screw);
    act(self.centreline_);
    act(self.swivel_);
    act(self.rotary_);
  }
  void inhibit();
  void serve(MonoTime now, const Sum& sum);
  void beat(MonoTime now);
  void describeAxes(MonoTime now);
  void describeRotary(MonoTime now);
  bool hasNeededReferences() const;

  CorrectionsConfig config_;
  std::array<AxisReference, kLinearAxes> references_;
  std::array<ScrewSource, kLinearAxes> screws_;
  CentrelineSource centreline_{config_.centreline};
  std::array<RotaryAngle, kRotaryAxes> angles_;
  ToolInSpindle tool_;
  SwivelSource swivel_{config_.swivel};
  RotarySource rotary_{config_.rotary};
  Output output_;
  ServedHistory history_;
  TriggerLog triggers_;
  std::uint16_t mask_{};
  std::optional<MonoTime> ticked_at_;
  Vector u_mm_{};  // positions of the last tick before referencing
  std::array<double, kLinearAxes> speed_mm_s_{};
  MonoTime sampled_at_{};  // time of the last record, on the time scale of advance()
  bool sampled_since_advance_{};
  bool tick_since_advance_{};
  bool was_valid_{};
  InhibitLines inhibit_lines_;
  bool inhibit_said_{};  // by the controller
  CorrectionsState state_;
  MonoTime heartbeat_at_{};
  MonoTime fresh_at_{};
  bool started_{};
  bool tick_since_heartbeat_{};
};

}  // namespace probebox::corrections
