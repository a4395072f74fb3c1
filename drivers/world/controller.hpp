#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/world/box_link.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/route.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// What the controller's program knows. It has set the features up by hand, so that their places are a little wrong.
struct ControllerConfig {
  Vector3 nominal_centre_mm{10.12, -20.08, 30.1};
  double nominal_effective_radius_mm{15.5};  // datum sphere and stylus ball
  struct Plates {
    bool known{false};
    Vector3 middle_mm{};
    double half_way_mm{};  // from the middle to where the stylus ball's centre meets a face
  } plates;
  struct Part {
    Vector3 point_mm{};  // of the rotary axis C, which is taken to be along Z
    std::array<Vector3, PartSpindleConfig::kMostBalls> balls_mm{};  // relative to it, at C = 0
    std::size_t ball_count{0};
    double effective_radius_mm{};
  } part;
  struct Table {
    bool tilts{false};
    Vector3 point_mm{};     // of the axis that it tilts about
    Vector3 axis{1, 0, 0};  // which is taken to be along one of the machine's
  } table;
  struct Head {
    bool swivels{false};
    Vector3 pivot_mm{};     // of its axis, from the gauge line
    Vector3 axis{0, 1, 0};  // which is taken to be along one of the machine's
  } head;
  struct Setter {
    bool known{false};
    Vector3 centre_mm{};  // machine position of the first tool, its stylus ball in the middle of the device
    Vector3 half_width_mm{};
    double stylus_ball_radius_mm{};
  } setter;
  struct Tool {
    std::uint32_t number{1};
    double length_mm{150};              // from the gauge line to the stylus ball or the tip
    std::optional<double> radius_mm{};  // of a tool that cuts; its tip ends it
  };
  std::vector<Tool> tools{Tool{}};  // the first is there at the start
  double safe_distance_mm{2};       // traverses stay this far from the surface
  Vector3 park_mm{10, -20, 110};    // at a height that is free everywhere
  bool homes{true};                 // tells a box that has just started where the axes stand
  double run_out_mm{1.5};           // the retract keeps its speed until the clearance, and stops this far beyond
  Nanoseconds settle{std::chrono::milliseconds{50}};  // at rest before a step begins
  Nanoseconds dwell{std::chrono::milliseconds{100}};  // at overtravel
  // At rest after the retract and before the step ends: longer than all delays and the link together.
  Nanoseconds afterwards{std::chrono::milliseconds{60}};
  Nanoseconds status_interval{std::chrono::milliseconds{50}};
  Nanoseconds resend_interval{std::chrono::milliseconds{200}};
  Nanoseconds give_up{std::chrono::seconds{2}};  // a marker that is not answered by then
};

enum class Activity : std::uint8_t {
  asking,      // at rest, wants to know what to do
  rising,      // off the feature before, to the free height
  turning,     // the rotary axes
  travelling,  // to the approach point
  settling,
  beginning,  // the marker is with the box
  approaching,
  dwelling,
  retracting,
  recording,    // at rest, the delayed streams catch up
  ending,       // the marker is with the box
  abandoning,   // the marker is with the box
  withdrawing,  // off the surface, because the procedure has gone
  parking,
};

// The emulated CNC controller: does what the box prompts for, as a measuring cycle would. It commands the machine and
// talks to the box through the link; it knows nothing else.
class Controller {
 public:
  Controller(const ControllerConfig& config, Machine& machine, BoxLink& link);

  // Time is given. To be called often: every millisecond or so of virtual time, before World::advanceTo(now).
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
  bool known(const Prompt& prompt) const;
  Pose pose() const;
  bool mustTurn() const;
  Vector3 ballOfThePart() const;
  Vector3 middle() const;
  std::uint32_t tool() const;
  const ControllerConfig::Tool& toolNumbered(std::uint32_t number) const;
  Vector3 tipIn(const Pose& pose, std::uint32_t tool) const;
  double freeHeight(const Pose& pose, std::uint32_t tool) const;
  Place setterFrom(const Vector3& tip) const;
  Place place() const;
  void rise();
  void turn();
  bool arrived();
  void travel(Activity then);
  void post(MarkerPhase phase, Activity waiting);
  void awaitAnswer();
  void answered(bool taken);
  void touch();
  void withdraw();
  void park();
  void level();
  Vector3 beginning() const;
  Vector3 surface() const;
  Vector3 outOfSurface(double distance_mm) const;

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
  MonoTime homed_{MonoTime::min()};  // when the box was told, or the machine last moved
  std::optional<Place> near_;        // where the probe is, unless at the free height
  Route route_;
  std::uint64_t finished_steps_{};
  std::uint64_t abandoned_steps_{};
  std::uint64_t resent_markers_{};
};

}  // namespace probebox::world
