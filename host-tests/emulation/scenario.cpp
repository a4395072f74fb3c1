#include "host-tests/emulation/scenario.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "board/describe/parse.hpp"
#include "firmware/app/wiring/box_config.hpp"
#include "firmware/app/wiring/corrections_config.hpp"
#include "firmware/procedure/described/machine_facts.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"

namespace probebox::scenario {
namespace {

constexpr Nanoseconds kTimeAdvances = std::chrono::milliseconds{10};

const board::Descriptions& sim() {
  static const auto descriptions = board::simDescriptions();
  return *descriptions;
}

const board::Descriptions& lathe() {
  static const auto descriptions = board::simLatheDescriptions();
  return *descriptions;
}

// The board that is compiled in and has the axes of this world.
const board::Descriptions& describedFor(const world::Config& config) {
  return config.machine.has_y ? sim() : lathe();
}

Nanoseconds interval(double rate_hz) {
  return Nanoseconds{std::llround(1e9 / rate_hz)};
}

}  // namespace

world::Config warmingWorld(const std::filesystem::path& config) {
  if (config.empty()) return {*sim().world, sim().machine};
  const auto other = board::simDescriptions(config);
  return {*other->world, other->machine};
}

world::Config warmingLatheWorld() {
  return {*lathe().world, lathe().machine};
}

world::Config latheWorld() {
  auto config = warmingLatheWorld();
  config.screws = {};
  config.encoders.power_up_mm = {};
  return config;
}

procedure::Facts latheFacts() {
  return procedure::factsOf(lathe());
}

world::Config usualWorld() {
  auto config = warmingWorld();
  config.screws = {};
  config.encoders.power_up_mm = {};
  return config;
}

box::BoxConfig usualBox(const world::Config& config) {
  box::BoxConfig box;
  box.clock.nominal_period = Nanoseconds{config.clock.period_ns};
  box.latch.samples_per_tick = 2;
  box.latch.probe.interval = interval(config.probe.rate_hz);
  for (auto& axis : box.latch.axes)
    axis = {.interval = interval(config.encoders.rate_hz), .interpolation = latch::Interpolation::cubic};
  // As described, which is not quite what the probe's oscillator does.
  box.probe_clock.rate_hz = config.probe.rate_hz * (1 + 60e-6);
  for (std::size_t i = 0; i < kLinearAxes; ++i)
    box.mm_per_count[i] = config.machine.axes[i].sense / config.encoders.counts_per_mm;
  box.has_y = config.machine.has_y;
  box.corrections = app::correctionsConfig(describedFor(config).machine);
  box.tool_setter_line = board::lineOfToolSetter(sim().box, sim().machine);
  box.probe_reads_distances = config.distance_probe.has_value();
  if (config.touch_trigger) {
    box.latch.probe.interval = {};
    box.probe_switch_line = std::uint8_t{0};
  }
  for (std::size_t i = 0; i < kLinearAxes; ++i) {
    auto& reference = box.corrections.references[i];
    reference.mm_per_count = box.mm_per_count[i];
    // Where nothing has to be found out, nothing is.
    if (config.encoders.power_up_mm == world::Vector3{}) reference.by = corrections::ReferenceBy::absolute;
    box.corrections.screws[i].fitted = config.screws[i].has_value();
    if (!config.screws[i]) box.corrections.mask = 0;
  }
  if (config.c_power_up_deg != 0) box.corrections.angles[2].reference.by = corrections::ReferenceBy::homing;
  return box;
}

procedure::Facts usualFacts() {
  return procedure::factsOf(sim());
}

app::MachineTravel usualTravel() {
  return app::travelOf(sim().machine);
}

app::MachineTravel travelOf(const procedure::Facts& facts) {
  return facts.has_y ? usualTravel() : app::travelOf(lathe().machine);
}

void Recorder::account(SampleIndex first, std::uint64_t count) {
  contiguous = contiguous && (!next || *next == first) && count > 0;
  next = first + static_cast<std::int64_t>(count);
}

bool Recorder::refuses(std::uint64_t count) {
  if (refuses_every == 0 || ++calls_ % refuses_every != 0) return false;
  refused_samples += count;
  return true;
}

bool Recorder::block(SampleIndex first, std::uint32_t count, std::span<const std::byte> block_bytes) {
  account(first, count);
  if (refuses(count)) return false;
  received += count;
  if (keeps_bytes) bytes.insert(bytes.end(), block_bytes.begin(), block_bytes.end());
  if (also != nullptr) also->block(first, count, block_bytes);
  return true;
}

bool Recorder::lost(const latch::Lost& lost) {
  account(lost.first, static_cast<std::uint64_t>(lost.count));
  if (refuses(static_cast<std::uint64_t>(lost.count))) return false;
  lost_samples += static_cast<std::uint64_t>(lost.count);
  if (keeps_bytes) bytes.push_back(static_cast<std::byte>(lost.reason));
  if (also != nullptr) also->lost(lost);
  return true;
}

void Recorder::trigger(const box::PlacedTrigger& trigger) {
  triggers.push_back(trigger);
  if (also != nullptr) also->trigger(trigger);
}

// A receiver reads the encoders as often as the probe, a controller once a cycle.
box::BoxConfig boxWith(const world::Config& config, ProbeIs probe) {
  auto box = usualBox(config);
  box.has_second_receiver = box.counts_have_own_stamps = probe == ProbeIs::two_front_ends;
  if (probe == ProbeIs::counted_with_axes || probe == ProbeIs::front_end || probe == ProbeIs::two_front_ends)
    for (auto& axis : box.latch.axes) axis.interval = box.latch.probe.interval;
  if (probe == ProbeIs::stamped_axes_told) {
    box.control_clock.rate_hz = 1e9 / static_cast<double>(ToldAxes::kCycle.count());
    for (auto& axis : box.latch.axes) axis.interval = ToldAxes::kCycle;
  }
  return box;
}

// Whoever set the part up told the controller which balls stand on it.
world::ControllerConfig controllerOf(const world::Config& config) {
  auto controller = world::controllerFor(*describedFor(config).world);
  controller.has_y = config.machine.has_y;
  auto& known = controller.known;
  known.part_spindle.balls_mm = config.part_spindle.balls_mm;
  known.part_spindle.further_mounts = config.part_spindle.further_mounts;
  known.distance_probe = config.distance_probe;
  if (config.distance_probe) known.sphere.stylus_ball_radius_mm = 0;
  if (known.cylinder && config.cylinder) known.cylinder->wall_mm = config.cylinder->wall_mm;
  // And that a tool is one for turning.
  for (const auto& tool : config.further_tools) {
    const auto same = std::ranges::find(known.further_tools, tool.number, &board::WorldTool::number);
    if (same != known.further_tools.end()) same->nose = tool.nose;
  }
  return controller;
}

// The controller's link without a wire: answers are there at once, state as of the last time that the box published it.
class Scenario::DirectLink : public world::BoxLink {
 public:
  explicit DirectLink(Scenario& scenario) : scenario_{scenario} {}

  world::BoxLink* other{};  // in the place of this one

  void postMarker(const Marker& marker) override {
    if (other != nullptr) return other->postMarker(marker);
    Marker stamped = marker;
    stamped.at = scenario_.now_;
    if (scenario_.as_reported) scenario_.as_reported(stamped);
    const auto& progress = scenario_.state().procedure;
    taken_ = marker.procedure == progress.run && marker.step == progress.step;
    if (*taken_) scenario_.push(stamped);
  }
  std::optional<bool> markerAnswer() override { return other != nullptr ? other->markerAnswer() : taken_; }
  void home(const world::Vector3& position_mm) override {
    if (other != nullptr) return other->home(position_mm);
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      scenario_.push(AxisHomed{static_cast<Axis>(axis), position_mm[axis], scenario_.now_});
  }
  void askProcedureStatus() override {}
  std::optional<world::Prompt> procedureStatus() override {
    if (other != nullptr) return other->procedureStatus();
    const auto& progress = scenario_.state().procedure;
    world::Prompt prompt{{}, progress.run, progress.state, progress.step, scenario_.state().snapshot.referenced};
    if (progress.step < progress.steps)
      static_cast<Step&>(prompt) = procedure::asked(scenario_.box_->plan().steps[progress.step]);
    return prompt;
  }

 private:
  Scenario& scenario_;
  std::optional<bool> taken_;
};

box::BoxConfig Scenario::boxOf() const {
  auto box = boxWith(config_, probe_is_);
  EmulatedEncoders::describe(encoders_are_, box);
  if (description_) description_(box);
  return box;
}

Scenario::Scenario(const world::Config& config, std::uint64_t seed, ProbeIs probe, EncodersAre encoders)
    : config_{config},
      probe_is_{probe},
      world_{config, seed},
      link_{std::make_unique<DirectLink>(*this)},
      controller_{controllerOf(config), world_.machine(), *link_},
      encoders_are_{encoders},
      now_{config.start},
      said_{config.start} {
  box_ = std::make_unique<box::Box>(boxOf(), recorder_);
  if (config.touch_trigger)
    facts.trigger_probe = procedure::TriggerProbe{.repeatability_mm = 1e-3 * config.touch_trigger->repeatability_um};
  if (probe == ProbeIs::counted) receiver_.emplace(seed);
  if (encoders != EncodersAre::stamped) encoders_ = std::make_unique<EmulatedEncoders>(encoders, world_, config);
  const auto counts = [this](MonoTime at) { return countsAt(at); };
  if (probe == ProbeIs::counted_with_axes) receiver_.emplace(seed, counts);
  auto marks_late_s = config.delays.tau_machine_s;  // as the counts, and the world's edges are late as the probe is
  for (auto& late_s : marks_late_s) late_s -= config.delays.tau_probe_s;
  if (probe == ProbeIs::front_end) front_end_.emplace(seed, counts, marks_late_s, FrontEndProbe::Wiring{});
  if (probe == ProbeIs::two_front_ends) {
    front_end_.emplace(seed, counts, marks_late_s, FrontEndProbe::Wiring{.axes = 0b101});
    second_front_end_.emplace(seed + 1, counts, marks_late_s,
                              FrontEndProbe::Wiring{.axes = 0b010, .receiver = 1, .offset_ppm = 37});
  }
  if (probe == ProbeIs::stamped_axes_told) told_.emplace(seed, config.start, counts);
}

// As stale as those of the world.
std::array<std::int64_t, kLinearAxes> Scenario::countsAt(MonoTime at) {
  const auto& encoders = config_.encoders;
  std::array<std::int64_t, kLinearAxes> counts{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const double noise_mm = std::normal_distribution{0.0, 1e-3 * encoders.noise_um}(encoder_noise_);
    const double position_mm =
        machine().positionAt(at, config_.delays.tau_machine_s[axis])[axis] + encoders.power_up_mm[axis] + noise_mm;
    counts[axis] = config_.machine.axes[axis].sense * std::llround(position_mm * encoders.counts_per_mm);
  }
  return counts;
}

Scenario::~Scenario() = default;

void Scenario::speakThrough(world::BoxLink& link) {
  link_->other = &link;
}

void Scenario::push(const Event& event) {
  if (keeps_events_) events_.push_back(event);
  if (around) around(event);
  box_->push(event);
}

// On from the world, by way of the receiver where there is one.
void Scenario::pass(Event event) {
  if (encoders_ && encoders_->replaces(event)) return;
  if (auto* const edge = std::get_if<Edge>(&event)) {
    latchEncoders(*edge);
    auto& line = lines_.at(static_cast<std::size_t>(edge->role)).at(edge->line);
    line.newest = edge->line_sequence;
    edge->line_sequence -= line.before;
    if (second_front_end_) {
      second_front_end_->advance(edge->at);
      const bool misses = second_misses_sync && edge->role == LineRole::sync;
      const bool is_its_alone = !misses && second_front_end_->take(*edge) && edge->role != LineRole::sync;
      if (is_its_alone) return;
    }
    if (front_end_ && front_end_->take(*edge)) return;
  }
  const auto* const deflection = std::get_if<Deflection>(&event);
  if (receiver_ && deflection != nullptr) {
    receiver_->take(*deflection);
  } else if (front_end_ && deflection != nullptr) {
    front_end_->take(*deflection);
  } else if (!countsComeOtherwise() || !std::holds_alternative<Count>(event)) {
    enqueue(event);
  }
}

// The counters hear the sync line itself, and not what the kernel stamps.
void Scenario::latchEncoders(const Edge& edge) {
  if (!encoders_ || edge.role != LineRole::sync) return;
  const auto from = world_.trueEdge(edge.line_sequence);
  if (!from || from->origin != world::EdgeOrigin::tick) return;
  if (const auto tick = world_.trueTick(from->tick)) encoders_->latch(tick->at);
}

// What did not fit is declared before the next event that does, as the capture thread does it.
void Scenario::enqueue(const Event& event) {
  if (no_room_for_ > 0) {
    --no_room_for_;
    dropped_.keep(event);
    return;
  }
  const auto take = [this](const Event& earlier) {
    push(earlier);
    return true;
  };
  dropped_.report(take, now_);
  push(event);
}

void Scenario::step() {
  now_ += step_;
  controller_.advance(now_);
  world_.advanceTo(now_);
  while (const std::size_t count = world_.poll(batch_))
    std::for_each_n(batch_.begin(), count, [this](auto& e) { pass(e); });
  while (const std::size_t count = encoders_ ? encoders_->read(batch_, now_) : 0)
    std::for_each_n(batch_.begin(), count, [this](auto& e) { enqueue(e); });
  for (Event counted; receiver_ && receiver_->next(now_, counted);) enqueue(counted);
  for (Event counted; front_end_ && front_end_->next(now_, counted);) enqueue(counted);
  if (second_front_end_) second_front_end_->advance(now_);
  for (Event counted; second_front_end_ && second_front_end_->next(now_, counted);) enqueue(counted);
  while (told_) {
    const auto told = told_->next(now_);
    if (!told) break;
    enqueue(*told);
  }
  if (now_ - said_ >= kTimeAdvances) {
    push(TimeAdvanced{now_});
    said_ = now_;
  }
}

void Scenario::run(Nanoseconds duration) {
  for (const MonoTime end = now_ + duration; now_ < end;) step();
}

bool Scenario::runUntil(const std::function<bool()>& done, Nanoseconds at_most) {
  for (const MonoTime end = now_ + at_most; now_ < end && !done();) step();
  return done();
}

void Scenario::inject(world::FaultKind kind, Nanoseconds from_now, Nanoseconds duration, Nanoseconds jump) {
  world_.inject({.kind = kind, .at = now_ + from_now, .duration = duration, .jump = jump});
}

std::optional<metrology::Solved> Scenario::calibrate(const procedure::LiveMethod& method,
                                                     const ProcedureOptions& options) {
  return finish(start(method, options));
}

std::uint32_t Scenario::start(const procedure::LiveMethod& method, const ProcedureOptions& options) {
  recorder_.run_to_solve.reset();
  runUntil([this] { return state().snapshot.referenced; }, std::chrono::seconds{5});
  push(ProcedureStarted{.run = ++last_run_, .method = method.number, .at = now_, .options = options});
  return last_run_;
}

std::optional<metrology::Solved> Scenario::finish(std::uint32_t run_number) {
  runUntil([this] { return recorder_.run_to_solve.has_value(); }, std::chrono::seconds{600});
  if (recorder_.run_to_solve != run_number) return std::nullopt;
  auto of_run = facts;
  of_run.temperature_c = box_->plan().temperature_c;
  auto measured = procedure::runDataset(*box_->plan().method, box_->recording(), box_->scales(), of_run);
  if (auto next = procedure::nextLoop(*box_->plan().method, box_->recording(), box_->scales(), facts, measured)) {
    recorder_.run_to_solve.reset();
    next->run = run_number;
    next->at = now_;
    push(*next);
    return finish(run_number);
  }
  dataset_ = std::move(measured.dataset);
  if (dataset_.table("tool_store")) dataset_.config["measured_at_s"] = 1.7e9;
  auto solved = measured.refusal ? metrology::Solved{*measured.refusal} : metrology::solve(dataset_);
  push(Solved{.run = run_number, .refused = !solved, .result_id = 1, .at = now_});
  run(kTimeAdvances);
  return solved;
}

void Scenario::activateDelay(const std::array<double, 3>& tau_s) {
  push(DelayActivated{.result_id = 99, .tau_s = tau_s, .sd_s = {1e-6, 1e-6, 1e-6}, .at = now_});
  run(kTimeAdvances);
}

void Scenario::restartBox(std::span<const Event> restored) {
  recorder_.run_to_solve.reset();  // the worker went with the box
  recorder_.next.reset();
  for (auto& role : lines_)
    for (auto& line : role) line.before = line.newest;
  box_ = std::make_unique<box::Box>(boxOf(), recorder_);
  for (const auto& event : restored) push(event);
  box_->showBeforeStart(now_);
}

Recorder replay(const std::vector<Event>& events, const world::Config& config) {
  Recorder recorder;
  box::Box box{usualBox(config), recorder};
  for (const auto& event : events) box.push(event);
  return recorder;
}

}  // namespace probebox::scenario
