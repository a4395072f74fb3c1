#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/method.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/finished_run.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/sides.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// The descriptor of a method's run on the machine. Each live method defines one `LiveMethod` in a file of its own in
// firmware/procedure/methods and is listed in one line of methods.hpp there. Plans, prompts, readiness, cases,
// `calibrate --help`, method numbers of registers and the table of runs in docs/metrology.md come from it.
namespace probebox::procedure {

// Something that has to be described before a method can run.
struct Fact {
  std::string_view place;                // for the docs: "machine.toml `[ball_plate]`"
  bool (*known)(const Facts&){nullptr};  // nullptr: checked elsewhere
  std::string_view missing;              // completes "METHOD needs ...", with the remedy
  bool shank_replaces{};                 // not needed when the shank is the second length
};

// Cause of a refusal, for its code: options that do not fit the method, this machine or its descriptions, or a state in
// which the same options may fit later, or something that would stand in the way of the stylus.
enum class Obstacle : std::uint8_t { option, state, way };
struct NotReady {
  Obstacle because{};
  std::string what;
};

// State of one linear axis when a run is to start.
struct AxisNow {
  bool referenced{};
  double position_mm{};
  bool screw_sensor_valid{};
};
using MachineNow = std::array<AxisNow, kLinearAxes>;

// Steps other than touches or holds at every pose.
struct OwnSteps {
  std::optional<Error> (*why_refused)(const ProcedureOptions&){};  // nullptr: options of touches
  void (*fill)(Plan&, const ProcedureOptions&){};
};

// A run whose later steps follow from what the earlier ones have measured. The state is the method's own.
struct Loops {
  LoopState first{};
  LoopState most{};  // the longest run: it has to fit into a plan
  // Worker: computes the answer that adds steps; nullopt when the run can be solved.
  std::optional<Solved> (*next)(const FinishedRun&, const RunDataset&){};
  // Core: the state after that answer; nullopt when the answer does not belong to this state. Does not allocate.
  std::optional<LoopState> (*after)(const LoopState&, const ProcedureOptions&, const Solved&){};
};

// Values of options.axis for the rotary axis whose errors are measured.
inline constexpr std::uint8_t kAxisB = 5, kAxisC = 6;

struct LiveMethod {
  std::uint16_t number{};             // in events, journals and registers: never reused
  const metrology::Method* solver{};  // its name is the name of the method
  // Completes "METHOD ..." where a touch-trigger probe cannot give the readings, with the remedy; empty where it can.
  std::string_view why_no_trigger{};
  // Completes "METHOD ..." where a machine without Y cannot make the run or tell its result, with the remedy; empty
  // where it can.
  std::string_view why_no_y{};
  bool by_distance{};         // a probe that does not touch gives the readings too
  bool cancels_pre_travel{};  // opposite touches and half turns of A cancel that of each tool: none has to be in force
  std::string_view steps;     // what the machine does, for the docs
  std::string_view steps_by_head{};   // with --head; empty: the method does not take it
  std::string_view steps_by_shank{};  // with --shank; empty: the method does not take it
  std::string_view steps_about_b{};   // with --axis B; empty: the method measures no rotary axis of choice
  std::span<const Fact* const> needs{};
  std::span<const Fact* const> needs_about_b{};  // further ones with --axis B
  bool finds_a_place{};       // the result is a machine position: needs the delay in force and referenced axes
  bool calibrates{true};      // false: the findings cannot come into force
  bool clamps_further_out{};  // a further mount is that of one ball, by hand, and no other place of a plate

  Feature feature{};
  Kind kind{};
  std::span<const Side> sides{};
  const Poses& poses{kAtZero};
  // Defaults of the options. A method takes approach, arc, angles, balls, angles of B, tools, stations and mounts only
  // where they have a default here.
  ProcedureOptions usual{};
  bool of_plate{};  // its balls are those of [ball_plate]
  // How many of its first readings are read again last, at their poses, to show what has moved since; of one pose, its
  // first touches.
  std::size_t closes{};
  bool takes_axis{};        // --axis X, Y or Z: whose screw, or across which the faces stand
  bool of_screw{};          // it is about the screw of that axis
  bool takes_turns{};       // --turns of it
  bool takes_tool{};        // --tool: the one to measure
  bool takes_probe_tool{};  // --tool: which of those that carry the probe
  bool takes_contacts{};    // --contacts: C turns until its ball touches, before everything else
  double least_arc_deg{1};
  std::uint16_t fewest_balls{2};

  // Hooks; nullptr: not needed.
  const OwnSteps* own_steps{};
  void (*first_steps)(Plan&, const ProcedureOptions& with_defaults){};  // before the touches
  std::optional<Error> (*also_refused)(const ProcedureOptions& with_defaults){};
  std::string (*prompt)(const Plan&, std::size_t step){};  // in place of the sentence about a touch
  // Completes the options from the descriptions.
  Outcome<ProcedureOptions> (*described)(ProcedureOptions, const Facts&){};
  // Explain why the run does not fit the descriptions, or the present state of the machine.
  std::optional<NotReady> (*why_unfit)(const ProcedureOptions&, const Facts&){};
  std::optional<Error> (*why_not_now)(const ProcedureOptions&, const MachineNow&, const Facts&){};

  RunDataset (*dataset)(const FinishedRun&){};
  Loops loops{};

  // For `probebox plan`.
  std::span<const std::span<const double>> speed_sets{};  // mm/s, worth trying, and repeats of each; empty: one speed

  std::string_view name() const { return solver->name; }
  bool takesHead() const { return kind == Kind::hold || !steps_by_head.empty(); }
  bool takesShank() const { return !steps_by_shank.empty(); }
  // --spindle: its results tell the chucks apart.
  bool takesSpindle() const;
  bool measuresBOrC() const { return !steps_about_b.empty(); }
  bool isAboutB(const ProcedureOptions& options) const { return measuresBOrC() && options.axis == kAxisB; }
};

// The list of a box; a test may give its own.
using LiveMethods = std::span<const LiveMethod* const>;

// nullptr for a number that no method has.
const LiveMethod* methodNumbered(LiveMethods methods, std::uint16_t number);

// Readings of a run, the closing ones included, and the pose of each, for options without zeros.
std::size_t readingsOf(const LiveMethod& method, const ProcedureOptions& with, const LoopState& loops);
Pose poseOf(const LiveMethod& method, const ProcedureOptions& with, const LoopState& loops, std::size_t reading);

// The options with the method's defaults in place of zeros.
ProcedureOptions withDefaults(const LiveMethod& method, ProcedureOptions options);

}  // namespace probebox::procedure
