#pragma once
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/world/box_link.hpp"
#include "drivers/world/random.hpp"

namespace probebox::world::testing {

// A box with its link: steps of a procedure, answers that take their time, messages that may be lost on either way.
class FakeBox : public BoxLink {
 public:
  FakeBox(std::vector<Prompt> steps, Nanoseconds latency, double loss, std::uint64_t seed)
      : steps_{std::move(steps)}, latency_{latency}, loss_{loss}, random_{seed, 99} {}

  void start(std::uint32_t run) {
    run_ = run;
    step_ = 0;
    state_ = RunState::waiting;
  }
  void abort() { state_ = RunState::aborted; }
  void cut(bool is_cut) { cut_ = is_cut; }
  // The status that the box tells is of that long ago.
  void publishLate(Nanoseconds lag) { lag_ = lag; }

  void postMarker(const Marker& marker) override {
    marker_answer_.reset();
    send({.at = {}, .id = ++marker_id_, .marker = marker, .prompt = {}, .taken = false});
  }
  std::optional<bool> markerAnswer() override { return marker_answer_; }
  void home(const Vector3&) override {}
  void askProcedureStatus() override {
    status_answer_.reset();
    send({.at = {}, .id = ++status_id_, .marker = std::nullopt, .prompt = {}, .taken = false});
  }
  std::optional<Prompt> procedureStatus() override { return status_answer_; }

  void advance(MonoTime now) {
    now_ = now;
    history_.push_back({now, {run_, step_, state_}});
    while (history_.size() > 1 && history_[1].first <= now - lag_) history_.pop_front();
    for (; !requests_.empty() && requests_.front().at <= now; requests_.pop_front()) serve(requests_.front());
    for (; !answers_.empty() && answers_.front().at <= now; answers_.pop_front()) deliver(answers_.front());
  }

  RunState state() const { return state_; }
  std::uint32_t step() const { return step_; }
  const Prompt& present() const { return steps_[step_]; }
  std::size_t abandoned() const { return abandoned_; }

 private:
  struct Message {
    MonoTime at{};
    std::uint64_t id{};
    std::optional<Marker> marker;
    Prompt prompt;
    bool taken{};
  };

  struct Standing {
    std::uint32_t run{};
    std::uint32_t step{};
    RunState state{};
  };

  bool lost() { return cut_ || random_.happens(loss_); }

  void send(Message message) {
    if (lost()) return;
    message.at = now_ + latency_;
    requests_.push_back(message);
  }

  void serve(Message message) {
    if (message.marker) message.taken = take(*message.marker);
    const Standing told = lag_ > Nanoseconds{} ? history_.front().second : Standing{run_, step_, state_};
    if (told.step < steps_.size()) message.prompt = steps_[told.step];
    message.prompt.run = told.run;
    message.prompt.step = told.step;
    message.prompt.state = told.state;
    if (lost()) return;
    message.at = now_ + latency_;
    answers_.push_back(message);
  }

  void deliver(const Message& message) {
    if (message.marker && message.id == marker_id_) marker_answer_ = message.taken;
    if (!message.marker && message.id == status_id_) status_answer_ = message.prompt;
  }

  bool take(const Marker& marker) {
    // The same marker again was taken already: its answer was lost.
    if (last_taken_ && last_taken_->at == marker.at && last_taken_->phase == marker.phase) return true;
    const bool measuring = state_ == RunState::waiting || state_ == RunState::running;
    if (!measuring || marker.procedure != run_ || marker.step != step_ || !marker.at_rest) return false;
    if (marker.phase != MarkerPhase::begin && state_ != RunState::running) return false;
    last_taken_ = marker;
    abandoned_ += marker.phase == MarkerPhase::abandon ? 1 : 0;
    if (marker.phase == MarkerPhase::end) ++step_;
    state_ = marker.phase == MarkerPhase::begin ? RunState::running : RunState::waiting;
    if (step_ == steps_.size()) state_ = RunState::solving;
    return true;
  }

  std::vector<Prompt> steps_;
  Nanoseconds latency_;
  double loss_;
  Random random_;
  MonoTime now_{};
  bool cut_{};
  Nanoseconds lag_{};
  std::deque<std::pair<MonoTime, Standing>> history_;
  std::uint32_t run_{};
  std::uint32_t step_{};
  RunState state_{};
  std::size_t abandoned_{};
  std::optional<Marker> last_taken_;
  std::uint64_t marker_id_{}, status_id_{};
  std::deque<Message> requests_, answers_;
  std::optional<bool> marker_answer_;
  std::optional<Prompt> status_answer_;
};

}  // namespace probebox::world::testing
