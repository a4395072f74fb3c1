#include "firmware/app/cnc/cnc_lines.hpp"

#include <pthread.h>

#include "protocol/modbus/refusals.hpp"

namespace probebox::app {
namespace {

published::KnownFeatures knownFeatures(const procedure::Facts& facts) {
  published::KnownFeatures known;
  known.stylus_radius_mm = facts.stylus_ball_diameter_mm / 2;
  if (facts.sphere_diameter_mm) known.sphere_reach_mm = *facts.sphere_diameter_mm / 2 + known.stylus_radius_mm;
  if (facts.gap_mm) known.gap_reach_mm = *facts.gap_mm / 2 - known.stylus_radius_mm;
  if (!facts.tool_setter) return known;
  known.has_setter = true;
  known.has_setter_place = facts.tool_setter->accepted_mm.has_value();
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    known.setter_half_width_mm[axis] = facts.tool_setter->half_width_mm[axis];
    if (known.has_setter_place) known.setter_mm[axis] = (*facts.tool_setter->accepted_mm)[axis];
  }
  return known;
}

}  // namespace

CncLine::CncLine(const Way& way, StateBuffer& states, const CncColleagues& colleagues)
    : may_{way.may},
      states_{states},
      with_{colleagues},
      name_{way.name},
      door_{way.kind + ":" + way.name},
      wishes_{"controller at " + name_,
              [this](messages::Operation operation, std::vector<std::byte> body, std::function<void(Reply)> then) {
                with_.links.ask({door_, may_, operation, std::move(body), std::move(then)});
              },
              [this](std::uint64_t result) { return with_.calibrations.inForce().isWaiting(result); }},
      server_{way.serve(faces(way.words))} {}

RegisterServer::Faces CncLine::faces(std::optional<modbus::WordOrder> words) {
  // A computer that connects anew goes on as the same reader.
  const auto nameOf = [this](std::string_view reader) {
    return door_ + (reader.empty() ? "" : " ") + std::string{reader};
  };
  RegisterDesk::Faces registers{
      .snapshot = [this] { return states_.newest().snapshot; },
      .shown_to = [this, nameOf](
                      std::string_view reader,
                      const published::Snapshot& snapshot) { return with_.served.shownTo(nameOf(reader), snapshot); },
      .take = [this](std::span<const Event> said) { return take(said); },
      .kept =
          [this, words] {
            return RegisterDesk::Kept{words.value_or(static_cast<modbus::WordOrder>(with_.doors.wordOrder(door_))),
                                      with_.doors.inhibits(door_)};
          },
      .line = [this](const published::Snapshot& snapshot) { return lineState(snapshot); },
      // Written down before the answer that has it goes out.
      .serves = [this, nameOf](const published::Snapshot& snapshot,
                               std::string_view reader) { with_.served.note(snapshot, nameOf(reader)); },
      .results = [this] { return with_.calibrations.inForce().served(); },
      .wish = [this](const modbus::Wish& wish) { wishes_.make(wish); },
      .may_wish = [this](const modbus::Wish& wish) { return mayWish(wish); },
      .only_looks = !board::givesARight(may_)};
  if (!words) registers.keep = [this](modbus::WordOrder order) { return keep(order); };
  return {.registers = std::move(registers),
          .report =
              [this, network = words.has_value()](const std::string& text) {
                if (network) return reported_.warn(time_.now(), text);
                logWarning(text);
              },
          .round =
              [this] {
                for (const auto& why : wishes_.newRefusals())
                  refused_.warn(time_.now(), "What " + name_ + " asked for was refused: " + why);
                refused_.look(time_.now());
                reported_.look(time_.now());
              }};
}

CncLine::~CncLine() {
  server_->stop();
  if (thread_.joinable()) thread_.join();
}

void CncLine::start() {
  thread_ = std::thread{[this] { server_->run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc");
}

messages::CncLineStatus CncLine::status() const {
  const auto counters = server_->counters();
  return {.name = name_,
          .answered = counters.answered,
          .refused = counters.refused,
          .bad_frames = counters.bad_frames,
          .skipped_bytes = counters.skipped_bytes,
          .unsent = counters.unsent,
          .reopened = counters.reopened};
}

published::LineState CncLine::lineState(const published::Snapshot& snapshot) {
  if (const auto in_force = with_.calibrations.inForce().served(); in_force != features_of_) {
    features_ = knownFeatures(with_.calibrations.factsNow());
    features_of_ = in_force;
  }
  std::uint16_t refusal = 0;
  if (snapshot.calibration == published::CalibrationState::refused) {
    const auto& step = snapshot.step;
    const bool in_a_step = snapshot.calibration_step < snapshot.calibration_steps;
    const auto text = with_.calibrations.lastRefusal();
    if (!in_a_step) {
      refusal = modbus::codeOfRefusal(text.substr(0, text.find(':')));
    } else {
      refusal = static_cast<std::uint16_t>(step.timed_out ? unsigned{modbus::refusal::step_never_ended}
                                                          : modbus::refusal::of_step + unsigned{step.fault});
    }
  }
  return {.boots = with_.boots, .calibration_refusal = refusal, .wish = wishes_.state(snapshot), .features = features_};
}

bool CncLine::take(std::span<const Event> said) {
  const auto error = with_.desk.take(said, door_, states_.newest(), may_);
  if (error) refused_.warn(time_.now(), "What " + name_ + " wrote was refused: " + error->what);
  return !error;
}

bool CncLine::mayWish(const modbus::Wish& wish) {
  using What = modbus::Wish::What;
  const bool runs = wish.what == What::start || wish.what == What::abort;
  if (runs ? may_.allow_calibrate : may_.allow_accept) return true;
  refused_.warn(time_.now(), "What " + name_ + " asked for was refused: service.toml does not allow it: set " +
                                 (runs ? "allow_calibrate" : "allow_accept") + " = true for this line.");
  return false;
}

bool CncLine::keep(modbus::WordOrder order) {
  const auto error = with_.doors.keepWordOrder(door_, static_cast<std::uint16_t>(order));
  if (error) logWarning("The word order of " + name_ + " was refused: " + error->what);
  return !error;
}

}  // namespace probebox::app
