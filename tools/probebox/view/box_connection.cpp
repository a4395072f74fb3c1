#include "tools/probebox/view/box_connection.hpp"

#include <chrono>
#include <limits>
#include <utility>

#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::view {
namespace {

using namespace std::chrono_literals;
using command::describe;

constexpr auto kSamples = 50ms;  // 20 pictures a second are drawn from new samples; the page moves them on in between
constexpr auto kState = 250ms;
constexpr double kPatience_s = 3600;  // a page is left open over lunch
constexpr auto kAnswerPatience = 30s;

Trouble linkDown() {
  return {command::ExitStatus::no_box, "link-lost", "the link to the box is down; it is being waited for"};
}

}  // namespace

BoxConnection::BoxConnection(link::Uri uri, EventLog& events, const std::atomic<bool>& interrupted)
    : events_{events},
      console_{command::Streams{nothing_, notes_, notes_, false, false, 0, stopped_}, false},
      listener_{*this},
      stream_{std::move(uri),
              {.policy = messages::Policy::live,
               .profile = std::nullopt,
               .patience = command::inMilliseconds(kPatience_s),
               .triggers = true},
              listener_,
              console_},
      interrupted_{interrupted} {}

BoxConnection::~BoxConnection() {
  stopped_ = true;
  if (thread_.joinable()) thread_.join();
}

std::optional<Trouble> BoxConnection::open() {
  if (auto trouble = stream_.open()) return trouble;
  thread_ = std::thread{[this] { run(); }};
  return std::nullopt;
}

void BoxConnection::run() {
  while (!stopped_ && !interrupted_) {
    if (!stream_.round()) {
      const std::lock_guard lock{mutex_};
      trouble_ = stream_.trouble();
      break;
    }
    const auto now = link::now();
    tellLink();
    if (now >= next_samples_) {
      next_samples_ = now + kSamples;
      const auto fresh = feed_.fresh().dump();
      if (fresh != "null") events_.put("samples", fresh);
    }
    if (now >= next_state_ && stream_.box() != nullptr) {
      next_state_ = now + kState;
      tellState();
    }
    // Without a link a round takes a second, and the answer is known.
    while (answerOne() && stream_.box() == nullptr) {
    }
  }
  // Nobody waits for ever.
  const std::lock_guard lock{mutex_};
  for (auto& one : asked_) one.answer.set_value(linkDown());
  asked_.clear();
  stopped_ = true;
}

bool BoxConnection::answerOne() {
  std::optional<Asked> one;
  {
    const std::lock_guard lock{mutex_};
    if (asked_.empty()) return false;
    one.emplace(std::move(asked_.front()));
    asked_.erase(asked_.begin());
  }
  one->answer.set_value(stream_.box() == nullptr ? Answer{linkDown()} : one->question(*stream_.box(), console_));
  return true;
}

BoxConnection::Answer BoxConnection::ask(Question question) {
  std::future<Answer> future;
  std::uint64_t number = 0;
  {
    const std::lock_guard lock{mutex_};
    if (stopped_) return linkDown();
    number = ++questions_;
    future = asked_.emplace_back(Asked{number, std::move(question), {}}).answer.get_future();
  }
  if (future.wait_for(kAnswerPatience) == std::future_status::ready) return future.get();
  {
    const std::lock_guard lock{mutex_};
    if (std::erase_if(asked_, [&](const Asked& one) { return one.number == number; }) > 0)
      return Trouble{command::ExitStatus::no_box, "timed-out",
                     "the box was busy with other questions, and this one was not asked: try again"};
  }
  return future.get();  // under way, and what it refers to is the caller's
}

BoxConnection::Answer BoxConnection::window(std::int64_t from_ns, std::int64_t to_ns, std::size_t columns) {
  return ask([=, this](link::Client&, Console&) -> Answer { return feed_.window(from_ns, to_ns, columns).dump(); });
}

void BoxConnection::tellLink() {
  const bool up = stream_.box() != nullptr;
  if (link_up_ == up) return;
  link_up_ = up;
  known_.link_up = up;
  if (!up) tellMachine(false);
  auto text = Json{{"up", up}, {"what", up ? "" : stream_.loss()}, {"reconnections", stream_.reconnections()}}.dump();
  events_.put("link", text, EventLog::Lasts::until_next);
  const std::lock_guard lock{mutex_};
  told_link_ = std::move(text);
}

// The whole state in one event: a page shows one instant, not parts of two.
void BoxConnection::tellState() {
  auto& box = *stream_.box();
  auto status = command::ask<messages::Status>(box, console_);
  auto corrections = command::ask<messages::Corrections>(box, console_);
  const auto procedure = command::ask<messages::ProcedureStatus>(box, console_);
  messages::ListResults::Request newest;
  newest.newest = 1;
  const auto results = command::ask<messages::ListResults>(box, console_, newest);
  const auto sums = stream_.tally().sinceStart();
  Json all{{"ledger",
            {{"produced_samples", sums.produced},
             {"received_samples", sums.received},
             {"lost_at_source_samples", sums.lost_at_source},
             {"lost_in_queue_samples", sums.lost_in_queue},
             {"lost_on_link_samples", sums.lost_on_link},
             {"balanced", stream_.tally().exactSinceStart()},
             {"box_restarts", stream_.tally().restarts()}}},
           {"values", feed_.newest()}};
  if (beat_) {
    all["clock"] = {{"state", std::string{messages::nameOf(beat_->clock_state)}}, {"sigma_ns", beat_->clock_sigma_ns}};
    all["uptime_ms"] = beat_->uptime_ms;
  }
  all["status"] = status ? describe(*status) : Json(nullptr);
  all["corrections"] = corrections ? describe(*corrections) : Json(nullptr);
  all["procedure"] = procedure ? describe(*procedure) : Json(nullptr);
  const bool any = results && !results->results.empty();
  all["newest_result"] = any ? Json(results->results.back().id) : Json(nullptr);
  all["active_results"] = status ? Json(status->active_results) : Json(nullptr);
  events_.put("state", all.dump());
  const auto optional = [](auto& answer) { return answer ? std::optional{std::move(*answer)} : std::nullopt; };
  known_.link_up = true;
  known_.status = optional(status);
  known_.corrections = optional(corrections);
  // A box that was started anew may have another machine.toml.
  const auto told =
      std::to_string(stream_.reconnections()) + all["newest_result"].dump() + all["active_results"].dump();
  tellMachine(std::exchange(told_results_, told) != told);
}

// The verdict on the machine, whenever it has changed. Results and requirements are read anew only when there are other
// results, or after a reconnection.
void BoxConnection::tellMachine(bool results_changed) {
  if (results_changed) {
    auto& box = *stream_.box();
    auto results = command::storedResults(box, console_, {}, std::numeric_limits<std::size_t>::max());
    if (results) known_.results = std::move(*results);
    auto machine = command::ask<messages::DescribeMachine>(box, console_);
    if (machine) known_.requirements = std::move(machine->requirements);
    if (!results || !machine) told_results_.clear();  // again with the next state
  }
  auto text = command::describe(command::judge(known_)).dump();
  if (text == told_machine_) return;
  events_.put("machine", text, EventLog::Lasts::until_next);
  const std::lock_guard lock{mutex_};
  told_machine_ = std::move(text);
}

std::string BoxConnection::machine() {
  const std::lock_guard lock{mutex_};
  return told_machine_.empty() ? "null" : told_machine_;
}

std::string BoxConnection::linkState() {
  const std::lock_guard lock{mutex_};
  return told_link_.empty() ? "null" : told_link_;
}

std::string BoxConnection::about() {
  const std::lock_guard lock{mutex_};
  return about_;
}

std::optional<Trouble> BoxConnection::trouble() const {
  const std::lock_guard lock{mutex_};
  return trouble_;
}

void BoxConnection::Listener::onDescriptor(const messages::Descriptor& descriptor) {
  connection.descriptor_ = descriptor;
  connection.feed_.describe(descriptor);
  auto text = describe(descriptor).dump();
  connection.events_.put("descriptor", text, EventLog::Lasts::until_next);
  const std::lock_guard lock{connection.mutex_};
  connection.about_ = std::move(text);
}

void BoxConnection::Listener::onBlock(const link::DecodedBlock& block) {
  connection.feed_.describe(block.descriptor);
  connection.feed_.add(block);
}

void BoxConnection::Listener::onTrigger(const messages::Trigger& trigger) {
  connection.events_.put("trigger", describe(trigger).dump());
}

void BoxConnection::Listener::onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>&) {
  connection.beat_ = beat;
}

}  // namespace probebox::view
