#pragma once
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "firmware/results/decide.hpp"
#include "host-tests/decided/decided.hpp"

namespace probebox::results {

// A ledger with its history, and results whose only value is a number. Two numbers differ when they are 1 or more
// apart.
class BoxOfResults {
 public:
  Id propose(const std::string& subject, double value, std::vector<Id> rests_on = {}) {
    auto binding = kHere;
    binding.subject = subject;
    metrology::Result result;
    result.method = "measured";
    result.estimates = {metrology::Estimate::scalar("value", value, 0.1)};
    return store({binding, std::move(result), {.rests_on = std::move(rests_on)}});
  }

  Outcome<Decision, Failure> perform(const Command& command, bool cut_is_on = false) {
    TRY(auto decision, decide(ledger_, values_, command, {.on = cut_is_on}));
    before_ = ledger_;
    if (decision.proposal) store(*decision.proposal);
    for (const auto& change : decision.changes) append(change.result, change.to, change.by);
    return decision;
  }
  // As where a line rises before anybody has been told.
  void revert(const Decision& decision) {
    const auto undone = undoneByCut(decision);
    for (const auto& change : undone) {
      const auto last = std::ranges::find(history_.rbegin(), history_.rend(), change.result, &Transition::result);
      history_.erase(std::next(last).base());
    }
    ledger_ = replayed();
    number_ = ledger_.lastNumber();
  }

  Outcome<Decision, Failure> accept(Id id, bool although_it_differs = true, bool cut_is_on = false) {
    return perform(Accept{id, "Ada", although_it_differs}, cut_is_on);
  }
  Outcome<Decision, Failure> rollBack(const std::string& subject, bool cut_is_on = false) {
    return perform(RollBackSubject{about(subject), "Grace"}, cut_is_on);
  }

  static Binding about(const std::string& subject) {
    auto binding = kHere;
    binding.subject = subject;
    return binding;
  }
  Id inForce(const std::string& subject) const {
    const auto* entry = ledger_.inForce(about(subject));
    return entry == nullptr ? 0 : entry->id;
  }
  State stateOf(Id id) const { return ledger_.find(id)->state; }
  double valueOf(Id id) const { return records_.at(id)->result()->find("value")->value(); }

  // The ledger that a start reads, but for a result that is lost.
  Ledger replayed(Id lost = 0) const {
    store::Contents contents{.heads = {}, .dependences = {}, .transitions = history_, .next_id = records_.size() + 1};
    for (const auto& [id, record] : records_) {
      if (id == lost) continue;
      store::Contents::Head head{.id = id, .state = State::proposed, .binding = record->binding, .accepted_by = {}};
      for (const auto& each : history_) {
        if (each.result != id) continue;
        head.state = each.to;
        if (each.to == State::accepted) head.accepted_by = each.by;
      }
      contents.heads.push_back(head);
      for (const auto other : rests_on_.at(id)) contents.dependences.push_back({id, other});
    }
    Ledger ledger;
    ledger.add(contents);
    return ledger;
  }

  const Ledger& ledger() const { return ledger_; }
  const Ledger& before() const { return before_; }
  Values& values() { return values_; }

 private:
  static inline const Binding kHere{"", "P-1", "mill", "spindle"};

  Id store(const store::Proposal& proposal) {
    const Id id = records_.size() + 1;
    records_[id] = std::make_shared<const Record>(Record{.id = id,
                                                         .state = {},
                                                         .method = proposal.result.method,
                                                         .binding = proposal.binding,
                                                         .content = proposal.result,
                                                         .proposed_utc = {},
                                                         .accepted_utc = {},
                                                         .accepted_by = {},
                                                         .retired_utc = {}});
    rests_on_[id] = proposal.origin.rests_on;
    ledger_.add(id, proposal.binding, proposal.origin.rests_on);
    append(id, State::proposed, proposal.origin.by);
    return id;
  }
  void append(Id id, State to, const std::string& by) {
    history_.push_back({.number = ++number_,
                        .result = id,
                        .method = {},
                        .binding = records_.at(id)->binding,
                        .to = to,
                        .utc = {},
                        .by = by,
                        .remark = {}});
    ledger_.apply({&history_.back(), 1});
  }
  Values valuesOfNumbers() const {
    auto values = decided::plainValues(kHere, [this](Id id) {
      const auto found = records_.find(id);
      return found == records_.end() ? nullptr : found->second;
    });
    values.difference = [](const Record& next, const Record& present) {
      const double by = std::abs(next.result()->find("value")->value() - present.result()->find("value")->value());
      return Difference{.differs = by >= 1, .in_words = "value", .less_certain = {}, .exceeds_u = by >= 0.5};
    };
    values.sum = [](const Record& tip, const Record& offset) {
      auto sum = *tip.result();
      sum.estimates.front().values.front() += offset.result()->find("value")->value();
      return std::optional{sum};
    };
    return values;
  }

  std::map<Id, std::shared_ptr<const Record>> records_;
  std::map<Id, std::vector<Id>> rests_on_;
  std::vector<Transition> history_;
  std::uint64_t number_{};
  Ledger ledger_, before_;
  Values values_{valuesOfNumbers()};
};

}  // namespace probebox::results
