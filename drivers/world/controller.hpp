#pragma once
#include <cstdint>
#include <optional>

#include "drivers/world/box_link.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/places.hpp"
#include "drivers/world/route.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

enum class Activity : std::uint8_t {
  asking,      // at rest, asks for the next step
  rising,      // from the previous feature to the free height
  turning,     // the rotary axes
  travelling,  // to the approach point
  settling,
  beginning,  // the marker is with the box
  entering,   // onto the surface, to where a scan begins
  approaching,
  scanning,
  dwelling,
  retracting,
  leaving,      // the surface after a scan
  recording,    // at rest, the delayed streams catch up
  ending,       // the marker is with the box
  abandoning,   // the marker is with the box
  withdrawing,  // off the surface, because the procedure has ended
  parking,
};

// Emulates the CNC controller: performs the steps that the box prompts for, as a measuring cycle would. It commands the
// machine and uses the link to the box; it has no other access.
class Controller {
 public:
  Controller(const ControllerConfig& config, Machine& machine, BoxLink& link);

  // Advances to `now`. Call it about every millisecond of virtual time, before World::advanceTo(now).
  void advance(MonoTime now);

  Activity activity() const { return activity_; }
  std::uint64_t finishedSteps() const { return finished_steps_; }    // the box took the marker of the end
  std::uint64_t abandonedSteps() const { return abandoned_steps_; }  // to be repeated
  std::uint64_t resentMarkers() const { return resent_markers_; }

 private:
  void enter(Activity activity);
  bool elapsed(Nanoseconds duration) const { return now_ - entered_ >= duration; }
  void refreshStatus();
  void question();
  void askAnew();
  bool procedureHasGone() const;
  void leave();

  void home();
  void ask();
  void follow(const Prompt& prompt);
  bool knows(const Prompt& prompt) const;
  Pose pose() const;
  bool mustTurn() const;
  std::size_t mount() const;
  bool change();
  std::uint32_t tool() const;
  Place place() const;
  void rise();
  void turn();
  bool arrived();
  void travel(Activity then);
  void post(MarkerPhase phase, Activity waiting);
  void awaitAnswer();
  void answered(bool taken);
  void approach();
  void touch();
  void turnUntilContact();
  void withdraw();
  void park();
  void level();
  Vector3 beginning() const;
  Vector3 surface() const;
  Vector3 outOfSurface(double distance_mm) const;
  void enterScan();
  void scan();
  bool nextWay();
  void finish();
  Vector3 onScan(double depth_mm) const;
  Vector3 offSurface() const;

  ControllerConfig config_;
  Machine& machine_;
  BoxLink& link_;
  MonoTime now_{};
  Activity activity_{Activity::asking};
  MonoTime entered_{};
  MonoTime asked_{};
  bool question_open_{};
  std::optional<Prompt> status_;  // newer than the last marker, or nothing
  Prompt step_;                   // what is being done
  Marker marker_;                 // the one that was posted last
  MonoTime posted_{};
  MonoTime homed_{MonoTime::min()};  // when the box was told the position, or the machine last moved
  std::optional<Place> near_;        // where the probe is, unless at the free height
  Route route_;
  double depth_mm_{};  // of the present touch, behind the contact; without one, behind where it ought to be
  bool pressing_{};    // a step has brought the stylus onto a surface, and not off it yet
  std::size_t way_{};  // of a scan, that comes next
  double scan_rad_{};  // where it has come to
  std::uint64_t finished_steps_{};
  std::uint64_t abandoned_steps_{};
  std::uint64_t resent_markers_{};
};

}  // namespace probebox::world
