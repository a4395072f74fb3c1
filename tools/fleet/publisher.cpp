#include "tools/fleet/publisher.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::fleet {
namespace {

using command::Json;
using command::Trouble;
using messages::ResultHistory;
using messages::ResultState;
using messages::ResultTransition;

constexpr Nanoseconds kAskEvery{1'000'000'000};
constexpr Nanoseconds kTryAgainAfter{5'000'000'000};
constexpr int kMostTries = 120;  // 10 minutes
constexpr std::size_t kMessagesOfAnEntry = 2;

// A level of a topic, or a part of a file's name.
std::string asName(std::string text) {
  const auto is_usual = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'; };
  std::ranges::replace_if(
      text, [&](char c) { return !is_usual(static_cast<unsigned char>(c)); }, '_');
  return text.starts_with('.') || text.empty() ? "_" + text : text;
}

Entry entryOf(const ResultTransition& transition) {
  return {transition.number, std::to_string(transition.result_id) + " " + transition.utc};
}

// The link is gone; all else is about one result.
bool isOfLink(const Trouble& trouble) {
  return trouble.status == command::ExitStatus::no_box || trouble.status == command::ExitStatus::interrupted;
}

// A box that is busy, or whose disk fails, may answer later; a result that it has lost, or that cannot be read here,
// stays so.
bool mayPass(const Trouble& trouble) {
  return trouble.status == command::ExitStatus::box_refused && trouble.name != nameOf(messages::ErrorCode::not_found);
}

// Stands in for a result that is not to be had.
Json describeMissing(const ResultTransition& transition, const Trouble& trouble) {
  Json object{{"id", transition.result_id},    {"subject", transition.subject}, {"method", transition.method},
              {"machine", transition.machine}, {"probe", transition.probe},     {"problem", trouble.name},
              {"text", trouble.what},          {"history", Json::array()}};
  object["history"].push_back(command::describe(transition));
  return object;
}

std::string withOrigin(Json document, const std::string& serial_number, bool again) {
  Json all{{"serial_number", serial_number}, {"again", again}};
  all.update(document);
  return all.dump();
}

}  // namespace

std::string Publisher::topic(const std::string& of) const {
  return "probebox/v1/" + asName(serial_number_) + "/" + of;
}

void Publisher::say(const std::string& what) {
  if (std::exchange(said_, what) != what && !what.empty()) console_.note("probebox-fleet: " + what);
}

void Publisher::sayConnection() {
  const auto is = broker_->connected() ? "connected" : broker_->problem();
  if (!is.empty() && std::exchange(said_connection_, is) != is) console_.note("probebox-fleet: MQTT: " + is);
}

void Publisher::open(const std::string& serial_number) {
  serial_number_ = serial_number;
  broker_.reset();
  next_.clear();
  half_sent_ = 0;
  compared_with_.reset();
  told_state_ = 0;
  outbox_.emplace(Outbox::open(folder_ + "/" + asName(serial_number)));
  say(outbox_->notice());
  openBroker();
}

void Publisher::openBroker() {
  const Json last_will{{"up", false}, {"serial_number", serial_number_}};
  auto broker = Broker::open(options_, "probebox-" + asName(serial_number_), {topic("state"), last_will.dump()});
  if (broker) return void(broker_ = std::move(*broker));
  say(broker.error().what);
}

std::optional<Trouble> Publisher::round(link::Client* box, MonoTime now) {
  if (box != nullptr && box->described().serial_number != serial_number_) open(box->described().serial_number);
  // Its files may have come, or may be readable now.
  if (!broker_ && outbox_ && now - opened_ >= kTryAgainAfter) {
    opened_ = now;
    openBroker();
  }
  if (!broker_) return std::nullopt;
  for (const auto message : broker_->acknowledged()) outbox_->acknowledge(message);
  if (const auto error = outbox_->store()) say(error->what);
  sayConnection();
  if (box == nullptr || !broker_->connected()) return std::nullopt;
  // Only a box that has restarted can have another store.
  const auto& welcome = box->reader().welcome();
  if (welcome && compared_with_ != welcome->boot_id) {
    if (auto trouble = compareHistories(*box)) return trouble;
    compared_with_ = welcome->boot_id;
  }
  if (next_.empty() && now - asked_ >= kAskEvery) {
    asked_ = now;
    if (auto trouble = fetch(*box)) return trouble;
  }
  if (next_.empty() || now < not_before_ || !outbox_->hasRoomFor(kMessagesOfAnEntry)) return std::nullopt;
  return sendNext(*box, now);
}

// A store that was made anew counts from 1: what the number acknowledged last stands for tells it.
std::optional<Trouble> Publisher::compareHistories(link::Client& box) {
  const auto& last = outbox_->acknowledged();
  if (last.number == 0) return std::nullopt;
  const auto answer =
      command::ask<ResultHistory>(box, console_, {.id = 0, .subject = {}, .after_number = last.number - 1});
  if (!answer) return answer.error();
  const auto& all = answer->transitions;
  if (!all.empty() && entryOf(all.front()).number == last.number && entryOf(all.front()).identity == last.identity)
    return std::nullopt;
  say("the box has another history than the one that was published: it is published from its beginning");
  outbox_->startOver();
  next_.clear();
  half_sent_ = 0;
  return std::nullopt;
}

std::optional<Trouble> Publisher::fetch(link::Client& box) {
  auto answer = command::ask<ResultHistory>(box, console_, {.id = 0, .subject = {}, .after_number = outbox_->last()});
  if (!answer) return answer.error();
  if (answer->transitions.empty()) {
    if (outbox_->inFlight() == 0) outbox_->caughtUp();
    return std::nullopt;
  }
  if (const auto error = outbox_->announce(answer->transitions.back().number)) {
    say("nothing is published, as " + error->what);
    return std::nullopt;
  }
  next_.assign(std::make_move_iterator(answer->transitions.begin()),
               std::make_move_iterator(answer->transitions.end()));
  // There is more: the next part is asked for as soon as this one is sent.
  if (answer->more) asked_ = {};
  return std::nullopt;
}

// A result comes with the first entry about it.
std::optional<Trouble> Publisher::sendNext(link::Client& box, MonoTime now) {
  const auto& transition = next_.front();
  const auto again = outbox_->mayHaveBeenSent(transition.number) || half_sent_ == transition.number;
  const auto result = command::resultWithHistory(box, console_, transition.result_id);
  if (!result && isOfLink(result.error())) return result.error();
  if (!result) {
    say("result " + std::to_string(transition.result_id) + " is not published: " + result.error().what);
    // What comes after waits, but not for ever.
    if (mayPass(result.error()) && ++tries_ < kMostTries) {
      not_before_ = now + kTryAgainAfter;
      return std::nullopt;
    }
  }
  std::set<int> sent;
  const auto send = [&](const std::string& of, Json document) {
    const auto number = broker_->publish({topic(of), withOrigin(std::move(document), serial_number_, again)});
    if (number) sent.insert(*number);
    return number.has_value();
  };
  const bool is_first = result ? !result->history.empty() && result->history.front().number == transition.number
                               : transition.state == ResultState::proposed || transition.state == ResultState::refused;
  if (is_first) {
    const auto document = result ? describe(*result) : describeMissing(transition, result.error());
    if (!send("result/" + std::to_string(transition.result_id), document)) return std::nullopt;
    half_sent_ = transition.number;
  }
  // Where that is not taken, the result goes once more, with its entry.
  if (!send("history/" + std::to_string(transition.number), command::describe(transition))) return std::nullopt;
  outbox_->begin(entryOf(transition), std::move(sent));
  next_.pop_front();
  tries_ = 0;
  return std::nullopt;
}

void Publisher::publishState(const Observed* box) {
  if (!broker_ || !broker_->connected()) return;
  told_state_ = broker_->connections();
  Json all{{"up", box != nullptr}, {"serial_number", serial_number_}};
  if (box != nullptr) {
    all["status"] = command::describe(box->status);
    all["corrections"] = box->corrections ? command::describe(*box->corrections) : Json(nullptr);
  }
  broker_->publishState({topic("state"), all.dump()});
}

void Publisher::addMetrics(Exposition& to) const {
  to.add("probebox_mqtt_connected", "1 while there is a connection to the broker", MetricType::gauge, {},
         broker_ && broker_->connected() ? 1 : 0);
  to.add("probebox_mqtt_in_flight", "messages that the broker has not acknowledged yet", MetricType::gauge, {},
         outbox_ ? static_cast<double>(outbox_->inFlight()) : 0);
}

}  // namespace probebox::fleet
