#pragma once
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/store/record.hpp"

namespace probebox::campaign {

// Everything that the box has acknowledged: it must hold until another acknowledgement, even if the box dies.
class Believed {
 public:
  void accepted(const store::Record& record) {
    if (record.state == store::State::active) {
      in_force_[record.binding.subject] = record.id;
      waiting_.erase(record.binding.subject);
    } else if (!(in_force_.contains(record.binding.subject) && in_force_[record.binding.subject] == record.id)) {
      waiting_[record.binding.subject] = record.id;
    }
  }
  void rolledBack(const std::string& subject, const app::ResultsInForce::Return& changed) {
    in_force_.erase(subject);
    if (changed.active) in_force_[subject] = changed.active->id;
  }
  void inhibited(const std::string& connection) { held_.insert(connection); }
  void ended(const std::string& connection) { held_.erase(connection); }

  bool cutIsOn() const { return !held_.empty(); }
  const std::map<std::string, store::Id>& inForce() const { return in_force_; }
  std::optional<store::Id> inForce(const std::string& subject) const {
    const auto found = in_force_.find(subject);
    return found == in_force_.end() ? std::nullopt : std::optional{found->second};
  }

  // Compares with the state of the box. Waiting results come into force when no connection declares a cut any more.
  std::optional<std::string> whyBroken(const app::ResultsInForce& results, const app::ConnectionInhibits& connections) {
    for (const auto& connection : held_) {
      if (!connections.inhibits(connection)) return "the inhibit of " + connection + " is forgotten";
    }
    const auto active = results.active();
    const auto isActive = [&](store::Id id) { return std::ranges::find(active, id) != active.end(); };
    for (auto each = waiting_.begin(); each != waiting_.end();) {
      const auto [subject, id] = *each;
      if (!isActive(id)) {
        if (!results.isWaiting(id))
          return "result " + std::to_string(id) + " was accepted, and neither waits nor is in force";
        ++each;
        continue;
      }
      if (cutIsOn()) return "result " + std::to_string(id) + " came into force during a cut";
      in_force_[subject] = id;
      each = waiting_.erase(each);
    }
    for (const auto& [subject, id] : in_force_) {
      if (!isActive(id)) return "result " + std::to_string(id) + " about " + subject + " is not in force any more";
    }
    return std::nullopt;
  }

 private:
  std::map<std::string, store::Id> in_force_;
  std::map<std::string, store::Id> waiting_;
  std::set<std::string> held_;
};

}  // namespace probebox::campaign
