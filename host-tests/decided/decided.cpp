#include "host-tests/decided/decided.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

namespace probebox::decided {
namespace {

Outcome<results::Decision, Failure> perform(Store& store, const store::Binding& here, const results::Command& command,
                                            bool cut_is_on, const std::string& utc) {
  const auto values = plainValues(here, [&](Id id) {
    auto found = store.find(id);
    return found ? std::make_shared<const Record>(std::move(*found)) : nullptr;
  });
  for (bool again = false;; again = true) {
    TRY(const auto contents, store.load());
    results::Ledger ledger;
    ledger.add(contents);
    TRY(auto decision, decide(ledger, values, command, {.on = cut_is_on}));
    if (decision.isEmpty()) return decision;
    const auto appended = store.append(decision.changes, decision.proposal, contents.next_id, utc);
    if (appended) return decision;
    if (appended.error().reason != store::Reason::damaged || again) return appended.error();
  }
}

Outcome<Record, Failure> performAbout(Store& store, Id id, const results::Command& command, bool cut_is_on,
                                      const std::string& utc) {
  TRY(auto record, store.find(id));
  TRY(const auto decision, perform(store, record.binding, command, cut_is_on, utc));
  for (const auto& change : decision.changes) {
    if (change.result != id) continue;
    record.state = change.to;
    if (change.to == store::State::accepted) record.accepted_by = change.by, record.accepted_utc = utc;
    record.retired_utc = change.to == store::State::retired ? utc : "";
  }
  return record;
}

}  // namespace

results::Values plainValues(const store::Binding& here, std::function<std::shared_ptr<const Record>(Id)> record) {
  return {.here = here,
          .most_tool_lengths = 99,
          .record = std::move(record),
          .activation = [](const Record&) { return std::vector<Event>{}; },
          .none = [](const std::string&) { return std::nullopt; },
          .difference = [](const Record&, const Record&) { return results::Difference{}; },
          .sum = [](const Record&, const Record&) { return std::nullopt; },
          .probe_tool = [](const Record&) { return 1U; }};
}

Outcome<Record, Failure> accept(Store& store, Id id, const std::string& by, const std::string& utc, bool waits) {
  return performAbout(store, id, results::Accept{id, by, true}, waits, utc);
}

Outcome<Record, Failure> activate(Store& store, Id id, const std::string& utc) {
  return performAbout(store, id, results::Activate{id}, false, utc);
}

Outcome<Record, Failure> withdraw(Store& store, Id id, const std::string& by, const std::string& utc) {
  return performAbout(store, id, results::RollBack{id, by}, false, utc);
}

Outcome<std::optional<Record>, Failure> active(Store& store, const store::Binding& binding) {
  TRY(auto all, inState(store, store::State::active));
  const auto found = std::ranges::find(all, binding, &Record::binding);
  return found == all.end() ? std::optional<Record>{} : std::optional{std::move(*found)};
}

Outcome<std::vector<Record>, Failure> inState(Store& store, store::State state) {
  TRY(auto all, newest(store, SIZE_MAX));
  std::erase_if(all, [&](const Record& each) { return each.state != state; });
  std::ranges::reverse(all);
  return all;
}

Outcome<std::vector<Record>, Failure> newest(Store& store, std::size_t count) {
  TRY(const auto contents, store.load());
  std::vector<Record> records;
  for (auto head = contents.heads.rbegin(); head != contents.heads.rend() && records.size() < count; ++head) {
    TRY(auto record, store.find(head->id));
    records.push_back(std::move(record));
  }
  return records;
}

Outcome<RolledBack, Failure> rollBack(Store& store, const store::Binding& binding, const std::string& by,
                                      const std::string& utc) {
  TRY(const auto decision, perform(store, binding, results::RollBackSubject{binding, by}, false, utc));
  RolledBack back;
  for (const auto& change : decision.changes) {
    auto& record = (change.to == store::State::active ? back.active : back.retired).emplace();
    record.id = change.result;
    record.state = change.to;
  }
  return back;
}

}  // namespace probebox::decided
