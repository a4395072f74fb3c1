#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "drivers/world/controller.hpp"
#include "drivers/world/world.hpp"
#include "firmware/app/results/machine_range.hpp"
#include "firmware/app/threads/dropped_events.hpp"
#include "firmware/box/box.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "host-tests/emulation/counted_probe.hpp"
#include "host-tests/emulation/emulated_encoders.hpp"
#include "host-tests/emulation/front_end_probe.hpp"
#include "host-tests/emulation/told_axes.hpp"

namespace probebox::scenario {

// Records the output of a box, byte for byte, and accounts for its samples.
class Recorder : public box::Outputs {
 public:
  bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) override;
  bool lost(const latch::Lost& lost) override;
  void trigger(const box::PlacedTrigger& trigger) override;
  void state(const box::State&) override {}
  void solve(std::uint32_t run) override { run_to_solve = run; }

  std::vector<std::byte> bytes;
  std::vector<box::PlacedTrigger> triggers;
  std::uint64_t received{};
  std::uint64_t lost_samples{};
  bool contiguous{true};  // every index exactly once, in order
  std::optional<SampleIndex> next;
  std::optional<std::uint32_t> run_to_solve;
  bool keeps_bytes{true};
  std::uint64_t refuses_every{};  // so many calls of block() and lost(): there is no room then
  std::uint64_t refused_samples{};
  box::Outputs* also{};  // hears of blocks and losses too

 private:
  void account(SampleIndex first, std::uint64_t count);
  bool refuses(std::uint64_t count);
  std::uint64_t calls_{};
};

// The emulated board: screws that warm up, counters that have to be referenced. config: a folder with descriptions in
// place of those that are compiled in, such as board/sim-worn.
world::Config warmingWorld(const std::filesystem::path& config = {});
// The emulated lathe of X and Z, with cold screws and absolute encoders, and the facts in its descriptions.
world::Config warmingLatheWorld();
world::Config latheWorld();  // without screws, its axes referenced
procedure::Facts latheFacts();
// The emulated board with cold screws and absolute encoders.
world::Config usualWorld();
box::BoxConfig usualBox(const world::Config& config);
// The facts about features and rotary axes in the emulated board's descriptions.
procedure::Facts usualFacts();
// What a controller is told of a world, with its errors about where things are.
world::ControllerConfig controllerOf(const world::Config& config);
// The travel of its axes.
app::MachineTravel usualTravel();
// Of the board that has the axes of these facts.
app::MachineTravel travelOf(const procedure::Facts& facts);

// How samples reach the box: all stamped by the world; the probe's counted by a receiver, or by one that has the
// encoders too, or by the front end, which has lines as well; or positions told by the controller.
enum class ProbeIs { stamped, counted, counted_with_axes, front_end, two_front_ends, stamped_axes_told };

// A world, a controller and a box on virtual time: run(5s) takes milliseconds.
class Scenario {
 public:
  explicit Scenario(const world::Config& config = usualWorld(), std::uint64_t seed = 1,
                    ProbeIs probe = ProbeIs::stamped, EncodersAre encoders = EncodersAre::stamped);
  ~Scenario();

  void run(Nanoseconds duration);
  // Returns true if `done` became true within that time.
  bool runUntil(const std::function<bool()>& done, Nanoseconds at_most);
  // The capture queue has no room for the next so many events.
  // The controller uses this link from now on. It must outlive the scenario's last run.
  void speakThrough(world::BoxLink& link);
  // How far it advances at a time: 1 ms; the controller hears of the box no more often.
  void setStep(Nanoseconds step) { step_ = step; }
  void overflowQueue(std::uint32_t events) { no_room_for_ += events; }
  void inject(world::FaultKind kind, Nanoseconds from_now, Nanoseconds duration, Nanoseconds jump = {});
  // One that lies in the world counts from 0; nobody says so.
  void restartEncoder(std::size_t axis) { world_.restartEncoder(axis); }
  // Starts a run, lets the controller do it, and solves it as the worker would.
  std::optional<metrology::Solved> calibrate(const procedure::LiveMethod& method = procedure::kDelayMultiSpeed,
                                             const ProcedureOptions& options = {});
  // The run's two halves, for tests that do something in between.
  std::uint32_t start(const procedure::LiveMethod& method, const ProcedureOptions& options = {});
  std::optional<metrology::Solved> finish(std::uint32_t run);  // with all steps that follow from earlier ones
  // The measured data of the run that was solved last.
  const metrology::Dataset& dataset() const { return dataset_; }
  // A result about the delay comes into force.
  void activateDelay(const std::array<double, 3>& tau_s);
  // Changes what the box is described as, from its next start on.
  void describeBy(std::function<void(box::BoxConfig&)> description) { description_ = std::move(description); }
  // Restarts the daemon: a new box gets `restored` first, while the machine runs on. The lines are requested again, so
  // their edges count from 1.
  void restartBox(std::span<const Event> restored = {});

  const box::Box& box() const { return *box_; }
  const box::State& state() const { return box_->state(); }
  const Recorder& recorded() const { return recorder_; }
  const world::Controller& controller() const { return controller_; }
  const world::Machine& machine() const { return std::as_const(world_).machine(); }
  world::World& world() { return world_; }
  world::Truth truth() const { return world_.truth(); }
  const std::vector<Event>& events() const { return events_; }
  void keepEvents(bool keep) { keeps_events_ = keep; }
  Recorder& recorder() { return recorder_; }
  CountedProbe& receiver() { return *receiver_; }
  FrontEndProbe& frontEnd() { return *front_end_; }
  FrontEndProbe& secondFrontEnd() { return *second_front_end_; }
  bool second_misses_sync{};
  EmulatedEncoders& encoders() { return *encoders_; }
  ToldAxes& controllerThatTells() { return *told_; }
  MonoTime now() const { return now_; }
  // What a receiver's counters of the encoders read at this instant.
  std::array<std::int64_t, kLinearAxes> countsAt(MonoTime at);
  void push(const Event& event);

  // What the worker knows beforehand.
  procedure::Facts facts{usualFacts()};
  // Changes what the controller says in a marker.
  std::function<void(Marker&)> as_reported;
  // Called before every event, for tests that watch what handling it costs.
  std::function<void(const Event&)> around;

 private:
  class DirectLink;
  void step();
  bool countsComeOtherwise() const { return told_ || front_end_ || (receiver_ && receiver_->hasAxes()); }
  void pass(Event event);
  void latchEncoders(const Edge& edge);
  void enqueue(const Event& event);

  box::BoxConfig boxOf() const;

  // How the kernel counts the edges of a line, and how far it had got when the box was restarted.
  struct LineCount {
    std::uint32_t newest{};
    std::uint32_t before{};
  };
  world::Config config_;
  std::function<void(box::BoxConfig&)> description_;
  ProbeIs probe_is_;
  Recorder recorder_;
  std::unique_ptr<box::Box> box_;
  world::World world_;
  std::unique_ptr<DirectLink> link_;
  world::Controller controller_;
  std::optional<CountedProbe> receiver_;
  std::optional<FrontEndProbe> front_end_;
  std::optional<FrontEndProbe> second_front_end_;  // with Y
  EncodersAre encoders_are_{};
  std::unique_ptr<EmulatedEncoders> encoders_;
  std::optional<ToldAxes> told_;
  std::mt19937_64 encoder_noise_{1};
  MonoTime now_;
  MonoTime said_;
  metrology::Dataset dataset_;
  std::uint32_t last_run_{};
  std::uint32_t no_room_for_{};
  app::DroppedEvents dropped_;
  box::PerLine<LineCount> lines_{};
  std::array<Event, 64> batch_;  // cleared once, not at every step
  std::vector<Event> events_;
  bool keeps_events_{false};
  Nanoseconds step_{std::chrono::milliseconds{1}};
};

// The same events into another box.
Recorder replay(const std::vector<Event>& events, const world::Config& config = usualWorld());

}  // namespace probebox::scenario
