#include <cmath>
#include <set>
#include <string>

#include "firmware/metrology/dataset/subject.hpp"
#include "host-tests/campaign/stage.hpp"

// The rules, as docs/reliability.md lists them; those about joints are the follower's.
namespace probebox::campaign {

using namespace std::chrono_literals;

void Stage::check() {
  checkSources();
  checkLedger();
  checkHosts();
  checkValues();
  checkRun();
}

void Stage::checkSources() {
  const auto& now = served();
  if (believed_.cutIsOn() && now_ - began_ > kGrace && now_ - changed_ > kGrace && !now.inhibited)
    fail("a cut is on that the registers do not show");
  for (std::size_t kind = 0; kind < kSourceKinds; ++kind) {
    const bool summed = (now.mask & 1U << kind) != 0;
    const auto health = now.health.at(kind);
    if (now.valid && summed && health != published::Health::good && health != published::Health::held)
      fail("valid, and source " + std::to_string(kind) + " that is summed is not");
  }
  // Longer than T_hold without the input that a screw needs.
  constexpr Nanoseconds kHeldAtMost = 7s;
  for (const auto kind : {Kind::drop_drift, Kind::drop_encoders}) {
    const auto& trouble = troubles_.at(static_cast<std::size_t>(kind));
    if (now.valid && (now.mask & 1U) != 0 && trouble.on(now_ + kRound) && now_ - trouble.since > kHeldAtMost)
      fail("valid after more than T_hold of " + std::string{name(kind)});
  }
  // Results about the delays of some axes are in force beside each other; the number is that of the last one.
  std::set<store::Id> delays;
  for (const auto& [subject, id] : believed_.inForce())
    if (isAbout(subject, SubjectKind::delay)) delays.insert(id);
  if (!delays.empty() && now_ - changed_ > kGrace && now_ - began_ > kGrace && now_ >= worker_back_ + kGrace &&
      !delays.contains(now.delay.result_id))
    fail("delay " + std::to_string(*delays.begin()) + " was acknowledged as in force, and " +
         std::to_string(now.delay.result_id) + " is applied");
}

// Every sample index has one fate, and what was lost at its source is what the emulated machine withheld.
void Stage::checkLedger() {
  const auto& recorded = box().recorded();
  if (!recorded.contiguous) fail("an index of a sample is missing or comes twice");
  const auto& state = box().state();
  const auto truth = box().truth().ledger;
  if (!sums_known_ || queue_overflowed_ || (any_trouble_.until != kNever && now_ - any_trouble_.until < 1s)) return;
  if (state.lost.deflections != truth.dropped_probe - at_boot_.dropped_probe)
    fail("lost deflections: " + std::to_string(state.lost.deflections) + " counted, " +
         std::to_string(truth.dropped_probe - at_boot_.dropped_probe) + " withheld");
  if (state.lost.counts != truth.dropped_encoders - at_boot_.dropped_encoders)
    fail("lost counts: " + std::to_string(state.lost.counts) + " counted, " +
         std::to_string(truth.dropped_encoders - at_boot_.dropped_encoders) + " withheld");
  if (state.lost.sync_edges != truth.lost_edges - at_boot_.lost_edges)
    fail("lost edges: " + std::to_string(state.lost.sync_edges) + " counted, " +
         std::to_string(truth.lost_edges - at_boot_.lost_edges) + " withheld");
}

void Stage::checkHosts() {
  for (const auto& each : hosts_) {
    if (each.host->faults() > 0) fail("a host found " + std::to_string(each.host->faults()) + " faults in its stream");
    if (each.host->received() + each.host->declaredLost() != each.host->total()) fail("a host misses samples");
  }
}

// The reading of a cold screw that the box subtracts; here the true one is what is described.
double Stage::assumedReading_um(std::size_t axis) const {
  const auto id = believed_.inForce(std::string{"screw-reference-"} + "xyz"[axis]);
  return id ? readings_um_.at(*id) : 0;
}

// Screws alone, everything known: what is served is what the nuts are off by, once and not twice. A result that says
// more of a cold screw's reading than is true leaves as much of the extension.
void Stage::checkValues() {
  const auto& now = served();
  const bool known = now.valid && now.settled && !now.degraded && now.mask == 1 && !counts_stuck_ &&
                     now_ - began_ > 10s && now_ - changed_ > 10s && now_ >= worker_back_ + 10s &&
                     (any_trouble_.until == kNever || now_ - any_trouble_.until > 10s) && disk_back_ == kNever &&
                     box().controller().activity() == world::Activity::asking;
  if (!known) return;
  ++verdict_.tally.checks_of_values;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double position_mm = box().machine().positionAt(box().now())[axis];
    const auto& screws = box().world().screws();
    const double believed_um = screws.extension_um(axis, box().now()) - assumedReading_um(axis);
    const double error_mm = screws.lever(axis, position_mm) * believed_um * 1e-3;
    const double left_um = (error_mm + now.correction_mm.at(axis)) * 1e3;
    if (std::abs(left_um) > rules_.value_um)
      fail("axis " + std::to_string(axis) + " is corrected wrongly by " + std::to_string(left_um) +
           " um: the nut is off, as far as the box can know, by " + std::to_string(error_mm * 1e3) + " um");
  }
}

// Positions before and after do not go together.
void Stage::checkRun() {
  const auto& run = box().state().procedure;
  const bool is_whole = run.state == procedure::State::solving || run.state == procedure::State::proposed;
  if (torn_run_ == run.run && is_whole)
    fail("run " + std::to_string(run.run) + " is solved, though an encoder counted from elsewhere in it");
}

}  // namespace probebox::campaign
