#include "tools/fleet/queue/outbox.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <sstream>
#include <utility>

namespace probebox::fleet {
namespace {

constexpr std::size_t kFile_bytes = 256;
constexpr auto kEverything = std::numeric_limits<std::uint64_t>::max();

}  // namespace

// The file holds: number announced, number acknowledged, and the identity of that one.
Outbox Outbox::open(const std::string& path) {
  Outbox all{store::TwinFile::open(path, kFile_bytes, std::to_string(kEverything) + " 0 ")};
  std::istringstream text{all.file_.content()};
  text >> all.announced_ >> all.acknowledged_.number >> std::ws;
  std::getline(text, all.acknowledged_.identity);
  all.sent_before_ = all.announced_;
  return all;
}

std::size_t Outbox::inFlight() const {
  return std::accumulate(in_flight_.begin(), in_flight_.end(), std::size_t{0},
                         [](std::size_t sum, const InFlight& each) { return sum + each.messages.size(); });
}

std::optional<Error> Outbox::announce(std::uint64_t number) {
  if (number <= announced_) return std::nullopt;
  return write(number);
}

void Outbox::begin(Entry entry, std::set<int> messages) {
  in_flight_.push_back({std::move(entry), std::move(messages)});
}

void Outbox::acknowledge(int message) {
  for (auto& each : in_flight_) {
    if (each.messages.erase(message) != 0) break;
  }
  while (!in_flight_.empty() && in_flight_.front().messages.empty()) {
    acknowledged_ = std::move(in_flight_.front().entry);
    in_flight_.pop_front();
    changed_ = true;
  }
}

std::optional<Error> Outbox::store() {
  return changed_ ? write(announced_) : std::nullopt;
}

// After a damaged file everything counts as announced, until here.
void Outbox::caughtUp() {
  changed_ = changed_ || announced_ != acknowledged_.number;
  announced_ = sent_before_ = acknowledged_.number;
}

void Outbox::startOver() {
  in_flight_.clear();
  acknowledged_ = {};
  sent_before_ = 0;
  announced_ = 0;
  changed_ = true;
}

std::optional<Error> Outbox::write(std::uint64_t announced) {
  const auto text =
      std::to_string(announced) + " " + std::to_string(acknowledged_.number) + " " + acknowledged_.identity;
  if (const auto written = file_.write(text); !written) return Error{written.error().what};
  announced_ = announced;
  changed_ = false;
  return std::nullopt;
}

}  // namespace probebox::fleet
