#include "host-tests/campaign/stage.hpp"

#include <cmath>
#include <csignal>
#include <iterator>
#include <utility>

#include "host-tests/campaign/disk.hpp"
#include "host-tests/campaign/proposal.hpp"

namespace probebox::campaign {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kWorkerRound = 100ms;
constexpr Nanoseconds kCheckRound = 500ms;
constexpr std::size_t kMostHosts = 3;
constexpr const char* kPerson = "Ada";

constexpr std::array kMethods{"delay-multi-speed", "delay-in-out",        "delay-sphere",       "centreline",
                              "screw-calibration", "spindle-offset-four", "c-axis-alignment",   "tool-setter",
                              "swivel-error",      "rotary-axis-errors",  "centreline-by-steps"};

// Every other run is of a kind that all these machines can do in a minute.
std::string_view methodOf(std::uint64_t number) {
  return number % 2 == 0 ? kMethods.front() : kMethods.at(number / 2 % kMethods.size());
}

world::Config worldOf(const Play& play) {
  auto config = scenario::warmingWorld(play.world);
  config.clock.period_ns = play.tick.count();
  // Rates in proportion, so that a coarse clock makes a quick play.
  const double rate = 1e6 / static_cast<double>(play.tick.count());
  config.probe.rate_hz *= rate;
  config.encoders.rate_hz *= rate;
  if (play.absolute) config.encoders.power_up_mm = {};
  for (auto& screw : config.screws) {
    screw->face_um = {};  // what the box would have to calibrate first
    screw->cold_um = play.cold_um;
  }
  return config;
}

std::array<double, 3> ratesOf(const Play& play, const Rules& rules) {
  const auto limits = scenario::usualBox(worldOf(play)).corrections.limits;
  return {limits[0].rate_mm_s * rules.rate, limits[1].rate_mm_s * rules.rate, limits[2].rate_mm_s * rules.rate};
}

// How long an axis may have walked since what the disk has of it (docs/corrections.md).
double doubtAfter(Kind end, const Play& play) {
  if (end == Kind::cut_power) return app::AppliedCorrectionFile::kAhead_s;
  if (end != Kind::lose_applied) return 0;
  const auto limits = scenario::usualBox(worldOf(play)).corrections.limits;
  return limits[0].size_mm / limits[0].rate_mm_s;
}

}  // namespace

Stage::Stage(const Play& play, const std::filesystem::path& folder, const Rules& rules)
    : play_{play},
      folder_{folder},
      rules_{rules},
      office_{256U << 10U, 64, worldOf(play), play.seed},
      follower_{ratesOf(play, rules), play.poll_interval} {
  box().setStep(std::max(play.tick / 2, Nanoseconds{1ms}));
  std::signal(SIGXFSZ, SIG_IGN);
  verdict_.tally.plays = 1;
  begin();
}

Verdict Stage::run() {
  std::size_t next = 0;
  for (; now_ < play_.length && !verdict_.violation; now_ += kRound) {
    for (; next < play_.acts.size() && play_.acts[next].at <= now_; ++next) apply(play_.acts[next]);
    carryOn();
    office_.run(kRound);
    if (now_ % kWorkerRound == 0ns && now_ >= worker_back_) {
      verdict_.tally.solved += boot_->solve() ? 1U : 0U;
      boot_->look(last_served_file_->last());
      applied_lost_ = applied_lost_ && (!served().valid || disk_back_ != kNever);
      const auto before = believed_.inForce();
      if (const auto broken = believed_.whyBroken(boot_->inForce(), boot_->connections())) fail(*broken);
      if (believed_.inForce() != before) changed_ = now_;  // one that waited
    }
    if (now_ % play_.poll_interval == 0ns) follow();
    if (now_ % kCheckRound == 0ns) check();
  }
  setDiskFull(false);
  auto& tally = verdict_.tally;
  tally.reads = follower_.reads();
  tally.valid_reads = follower_.validReads();
  tally.hours = std::chrono::duration<double, std::ratio<3600>>{now_}.count();
  for (const auto& each : hosts_) {
    tally.samples += each.host->received();
    tally.lost_samples += each.host->declaredLost();
  }
  return std::move(verdict_);
}

void Stage::fail(const std::string& what) {
  if (!verdict_.violation) verdict_.violation = Violation{.at = now_, .what = what};
}

void Stage::apply(const Act& act) {
  ++verdict_.tally.acts.at(static_cast<std::size_t>(act.kind));
  if (static_cast<std::size_t>(act.kind) < kMachineKinds) return applyToMachine(act);
  if (act.kind <= Kind::stop) return applyToBox(act);
  if (act.kind <= Kind::stop_reading) return applyToHosts(act);
  command(act);
}

void Stage::applyToMachine(const Act& act) {
  auto& trouble = troubles_.at(static_cast<std::size_t>(act.kind));
  if (!trouble.on(now_)) trouble.since = now_;
  trouble.until = std::max(trouble.until, now_ + act.lasts);
  any_trouble_.until = std::max(any_trouble_.until, now_ + act.lasts);
  // What is missing before the first sample has come cannot be counted.
  if (now_ - began_ < kGrace) sums_known_ = false;
  counts_stuck_ = counts_stuck_ || act.kind == Kind::stick_encoders;
  box().inject(static_cast<world::FaultKind>(act.kind), 0ns, act.lasts,
               Nanoseconds{static_cast<std::int64_t>(act.number)});
}

void Stage::applyToBox(const Act& act) {
  switch (act.kind) {
    case Kind::replug_encoder:
      return replugEncoder(static_cast<std::size_t>(act.number));
    case Kind::overflow_queue:
      // As long in any world.
      box().overflowQueue(
          static_cast<std::uint32_t>(act.number * 1'000'000 / static_cast<std::uint64_t>(play_.tick.count())));
      queue_overflowed_ = true;
      any_trouble_.until = std::max(any_trouble_.until, now_ + 20s);
      return;
    case Kind::stall_worker:
      worker_back_ = now_ + act.lasts;
      return;
    case Kind::fill_disk:
      disk_back_ = now_ + act.lasts;
      setDiskFull(true);
      return;
    case Kind::unplug_line:
      line_back_ = now_ + act.lasts;
      return;
    default:
      restart(act);
  }
}

void Stage::replugEncoder(std::size_t axis) {
  if (!play_.absolute) box().restartEncoder(axis);
  is_unhomed_ = !play_.absolute;
  moved_ = now_;
  box().push(SourceLost{Source::encoders, LossReason::disconnected, 0, box().now(), axisBit(static_cast<Axis>(axis))});
  const auto& run = box().state().procedure;
  const bool is_measuring = run.state == procedure::State::waiting || run.state == procedure::State::running;
  if (!play_.absolute && is_measuring && run.step > 0) torn_run_ = run.run;
}

// The box ends in one of three ways, and comes back at once: whoever follows has the least time to forget.
void Stage::restart(const Act& act) {
  ++verdict_.tally.restarts;
  if (act.kind == Kind::stop) boot_->end(last_served_file_->last());
  boot_.reset();
  last_served_file_.reset();
  applied_lost_ = applied_lost_ || act.kind == Kind::lose_applied;
  // What was lost stays lost until the worker has written it anew.
  const bool from_disk = act.kind == Kind::cut_power || act.kind == Kind::lose_applied;
  follower_.expectRestart(box().now(), doubtAfter(from_disk && applied_lost_ ? Kind::lose_applied : act.kind, play_));
  if (from_disk) {
    std::error_code gone;
    std::filesystem::remove(folder_ / "served-last", gone);
    spoil(folder_ / "served", act.number);
    spoil(folder_ / "connections", act.number);
    // Its file is two copies of one block.
    if (act.kind == Kind::lose_applied) spoil(folder_ / "served", act.number + std::uint64_t{4096} * 8);
  }
  begin();
}

void Stage::begin() {
  last_served_file_.emplace((folder_ / "served-last").string(), scenario::usualBox(worldOf(play_)).corrections.limits);
  boot_.emplace(office_, folder_ / "results.db");
  office_.restartBox(boot_->restored(last_served_file_->before()));
  const auto& applied = boot_->applied();
  last_served_file_->setOnDisk(applied.startOnDisk(), applied.countOnDisk(), applied.appliedBefore());
  for (auto& each : hosts_) each.left = now_;
  hosts_.push_back({.host = &office_.add()});
  began_ = changed_ = now_;
  torn_run_.reset();
  is_unhomed_ = false;
  counts_stuck_ = troubles_.at(static_cast<std::size_t>(Kind::stick_encoders)).on(now_);
  queue_overflowed_ = false;
  sums_known_ = any_trouble_.until == kNever || now_ - any_trouble_.until > 1s;
  at_boot_ = box().truth().ledger;
}

void Stage::carryOn() {
  if (disk_back_ != kNever && now_ >= disk_back_) {
    setDiskFull(false);
    disk_back_ = kNever;
  }
  tendHosts();
  homeAgain();
}

// As an operator does it who finds an axis without a reference: when the machine has stood for a while.
void Stage::homeAgain() {
  constexpr Nanoseconds kStands = 500ms;
  if (!box().machine().atRest(box().now())) moved_ = now_;
  if (!is_unhomed_ || now_ - moved_ < kStands) return;
  const auto at_mm = box().machine().commandedPosition();
  for (std::size_t axis = 0; axis < at_mm.size(); ++axis) {
    if (!served().axes.at(axis).referenced) box().push(AxisHomed{static_cast<Axis>(axis), at_mm.at(axis), box().now()});
  }
  is_unhomed_ = false;
}

void Stage::tendHosts() {
  for (auto& each : hosts_) {
    if (each.reads_again != kNever && now_ >= each.reads_again) {
      each.reads_again = kNever;
      if (each.host->connected()) each.host->stopReading(false);
    }
    // A link that was cut is made again, as `probebox record` does it; not one to a box that has ended.
    if (!each.host->connected() && each.left == kNever) office_.connect(*each.host);
  }
}

void Stage::applyToHosts(const Act& act) {
  std::vector<Host*> connected;
  for (auto& each : hosts_)
    if (each.left == kNever && each.host->connected()) connected.push_back(&each);
  if (act.kind == Kind::connect) {
    if (connected.size() < kMostHosts) hosts_.push_back({.host = &office_.add()});
    return;
  }
  if (connected.empty()) return;
  auto& chosen = *connected.at(act.number % connected.size());
  if (act.kind == Kind::cut_link) return chosen.host->cutAfter(act.number);
  chosen.host->stopReading();
  chosen.reads_again = now_ + act.lasts;
}

void Stage::command(const Act& act) {
  switch (act.kind) {
    case Kind::propose:
      return propose(act.number);
    case Kind::start_run:
      boot_->start(methodOf(act.number));
      return;
    case Kind::abort_run:
      boot_->ask<messages::AbortProcedure>({.run = boot_->procedure().run});
      return;
    case Kind::accept:
      return accept();
    case Kind::roll_back:
      return rollBack(act.number);
    case Kind::inhibit:
    case Kind::end_inhibit:
      return inhibit(act);
    case Kind::home_outside: {
      messages::HomeAxes::Request request{.axes = static_cast<std::uint8_t>(1U << act.number), .position_mm = {}};
      request.position_mm.fill(10'000);
      if (boot_->ask<messages::HomeAxes>(request).code == messages::ErrorCode::ok)
        fail("a homing 10 m off the travel is acknowledged");
      return;
    }
    case Kind::choose_sources:
      boot_->ask<messages::EnableSources>({.mask = static_cast<std::uint16_t>(act.number)});
      return;
    default:
      return;
  }
}

// Beside the box, as the solver's process could not: what matters is that there is a result to accept.
void Stage::propose(std::uint64_t number) {
  auto store = store::Store::open((folder_ / "results.db").string());
  if (!store) return;
  const auto proposal = proposalOf(number);
  if (store->propose(boot_->inForce().bindingFor(proposal.subject), proposal.result, "", app::utcNow()))
    ++verdict_.tally.proposed;
}

void Stage::accept() {
  const auto proposed = boot_->newestProposed();
  if (!proposed) return;
  const auto accepted = boot_->inForce().accept(proposed->id, kPerson);
  if (!accepted) return;
  ++verdict_.tally.accepted;
  believed_.accepted(*accepted);
  if (const auto* reading = accepted->result()->find("reference_um")) readings_um_[accepted->id] = reading->value();
  changed_ = now_;
}

void Stage::rollBack(std::uint64_t number) {
  const auto& in_force = believed_.inForce();
  if (in_force.empty()) return;
  const auto at = static_cast<std::ptrdiff_t>(number % in_force.size());
  const std::string subject = std::next(in_force.begin(), at)->first;
  const auto changed = boot_->inForce().rollBack(subject, kPerson);
  if (!changed) return;
  if (believed_.cutIsOn() && now_ - began_ > kGrace) fail("a rollback succeeds during a cut");
  ++verdict_.tally.rolled_back;
  believed_.rolledBack(subject, *changed);
  changed_ = now_;
}

void Stage::inhibit(const Act& act) {
  const bool on = act.kind == Kind::inhibit;
  const std::string connection = "modbus:/dev/ttyS" + std::to_string(act.number);
  // A new inhibit that is not acknowledged may hold or not; one whose end is not acknowledged still holds.
  if (boot_->connections().setInhibit(connection, on, "").has_value()) {
    changed_ = now_;
    return;
  }
  if (on)
    believed_.inhibited(connection);
  else
    believed_.ended(connection);
  changed_ = now_;
}

void Stage::follow() {
  if (now_ < line_back_) return;
  const bool disk_is_full = disk_back_ != kNever;
  if (disk_is_full) setDiskFull(false);  // the record lies in memory
  const auto shown = last_served_file_->shownTo("controller", served());
  last_served_file_->note(shown, "controller");
  if (disk_is_full) setDiskFull(true);
  if (const auto broken = follower_.read(shown, box().now())) fail(*broken);
}

}  // namespace probebox::campaign
