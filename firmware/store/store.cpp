#include "firmware/store/store.hpp"

#include <array>
#include <utility>

#include "firmware/json/result_json.hpp"
#include "firmware/store/opening.hpp"
#include "firmware/store/rows.hpp"

namespace probebox::store {
namespace {

// A dataset of a run is up to a megabyte, one that a host proposes up to some twenty, a result a few kilobytes: the
// store must not grow with every run, nor fill a disk that needs room for an update.
Outcome<void, Failure> dropOldDatasets(Database& database) {
  Statement statement{
      database,
      "DELETE FROM datasets WHERE result_id IN (SELECT result_id FROM (SELECT d.result_id, row_number() OVER newest AS "
      "place, "
      "sum(length(d.json)) OVER newest AS characters FROM datasets d JOIN results r ON r.id = d.result_id "
      "WHERE r.accepted_utc = '' WINDOW newest AS (ORDER BY d.result_id DESC)) "
      "WHERE place > ? OR (place > 1 AND characters > ?))"};
  return statement.bind(static_cast<std::int64_t>(Store::kOtherDatasets))
      .bind(static_cast<std::int64_t>(Store::kOtherDatasetsCharacters))
      .run();
}

Outcome<void, Failure> keepDataset(Database& database, Id id, std::string_view dataset) {
  if (dataset.empty()) return {};
  Statement statement{database, "INSERT INTO datasets (result_id, json) VALUES (?, ?)"};
  if (const auto kept = statement.bind(stored(id)).bind(dataset).run(); !kept) return kept;
  Statement sum{database, "UPDATE datasets SET checksum = row_sum(result_id, json) WHERE result_id = ?"};
  if (const auto kept = sum.bind(stored(id)).run(); !kept) return kept;
  return dropOldDatasets(database);
}

Outcome<void, Failure> keepDependences(Database& database, Id id, const std::vector<Id>& rests_on) {
  for (const auto other : rests_on) {
    Statement statement{database, "INSERT INTO dependences (result_id, rests_on) VALUES (?, ?)"};
    if (const auto kept = statement.bind(stored(id)).bind(stored(other)).run(); !kept) return kept;
    Statement sum{database, "UPDATE dependences SET checksum = row_sum(id, result_id, rests_on) WHERE id = ?"};
    if (const auto kept = sum.bind(database.lastId()).run(); !kept) return kept;
  }
  return {};
}

Transition readTransition(const Statement& row) {
  return {.number = static_cast<std::uint64_t>(row.number(0)),
          .result = static_cast<Id>(row.number(1)),
          .method = row.text(2),
          .binding = {row.text(3), row.text(4), row.text(5), row.text(6)},
          .to = static_cast<State>(row.number(7)),
          .utc = row.text(8),
          .by = row.text(9),
          .remark = row.text(10)};
}

constexpr std::size_t kAllTransitions = 1'000'000'000;

// above: only of results with a greater number.
Outcome<std::vector<Transition>, Failure> readTransitions(Database& database, const HistoryRange& range, Id above) {
  Statement statement{database,
                      "SELECT t.id, t.result_id, method, subject, probe, machine, mounting, t.state, t.utc, t.by_whom, "
                      "coalesce((SELECT m.text FROM remarks m WHERE m.transition_id = t.id "
                      "AND m.checksum = row_sum(m.transition_id, m.text)), '') "
                      "FROM transitions t JOIN results r ON r.id = t.result_id "
                      "WHERE t.id > ? AND t.state <> 5 AND t.checksum = row_sum(t.id, t.result_id, t.state, t.utc, "
                      "t.by_whom) AND (?2 = 0 OR t.result_id = ?2) AND (?3 = '' OR subject = ?3) "
                      "AND t.result_id > ?4 ORDER BY t.id LIMIT ?5"};
  statement.bind(stored(range.after)).bind(stored(range.result)).bind(range.subject).bind(stored(above));
  statement.bind(static_cast<std::int64_t>(range.count));
  std::vector<Transition> transitions;
  while (true) {
    TRY(const auto row, statement.step());
    if (!row) return transitions;
    transitions.push_back(readTransition(statement));
  }
}

Outcome<std::vector<Contents::Head>, Failure> readHeads(Database& database, Id above) {
  Statement statement{database, select("WHERE state <> 5 AND id > ? ORDER BY id")};
  statement.bind(stored(above));
  std::vector<Contents::Head> heads;
  while (true) {
    TRY(const auto row, statement.step());
    if (!row) return heads;
    TRY(auto head, readHead(statement));
    heads.push_back(std::move(head));
  }
}

}  // namespace

std::string_view name(State state) {
  constexpr std::array<std::string_view, 5> kNames{"proposed", "accepted", "active", "retired", "refused"};
  const auto index = static_cast<std::size_t>(state);
  return index < kNames.size() ? kNames[index] : "unknown";
}

Store::Store(std::unique_ptr<Database> database, std::string notice)
    : database_{std::move(database)}, notice_{std::move(notice)} {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;

Outcome<Store, Failure> Store::open(const std::string& path) {
  TRY(auto opened, openFile(path));
  return Store{std::move(opened.database), std::move(opened.notice)};
}

Store Store::openAnyhow(const std::string& path, Before before) {
  const bool is_gone = before == Before::had_it && !isThere(path);
  auto sound = open(path);
  if (sound && is_gone && sound->notice_.empty()) {
    sound->notice_ =
        path + " is gone, and an empty store was begun: stop the box and restore a backup, or calibrate again";
  }
  if (sound) return std::move(sound).value();
  auto alone = openToReadAlone(path, sound.error());
  return Store{std::move(alone.database), std::move(alone.notice)};
}

const std::string& Store::whyNotWritable() const {
  return database_->whyNotWritable();
}

std::vector<std::string> Store::damage() {
  auto rows = damagedRows(*database_);
  return rows ? std::move(*rows) : std::vector<std::string>{rows.error().what};
}

bool Store::setDamagedRowsAside() {
  auto transaction = Transaction::begin(*database_);
  return transaction && markDamaged(*database_) && transaction->commit();
}

Outcome<Transition, Failure> Store::insert(const Binding& binding, const Content& content, std::string_view utc,
                                           const Origin& origin) {
  if (utc.empty()) return Failure{Reason::bad_argument, "a result needs the time at which it was found (UTC)"};
  Statement statement{*database_,
                      "INSERT INTO results (state, method, subject, probe, machine, mounting, result_json, "
                      "proposed_utc) VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  statement.bind(stored(content.state)).bind(content.method);
  TRY(bind(statement, binding).bind(content.json).bind(utc).run());
  const auto id = static_cast<Id>(database_->lastId());
  TRY(seal(*database_, id));
  TRY(const auto number, note(*database_, id, content.state, utc, origin.by, origin.remark));
  TRY(keepDependences(*database_, id, origin.rests_on));
  TRY(keepDataset(*database_, id, content.dataset));
  return Transition{.number = number,
                    .result = id,
                    .method = std::string{content.method},
                    .binding = binding,
                    .to = content.state,
                    .utc = std::string{utc},
                    .by = origin.by,
                    .remark = origin.remark};
}

Outcome<Transition, Failure> Store::change(const Change& change, std::string_view utc) {
  TRY(const auto record, find(change.result));
  if (record.state != change.from)
    return Failure{Reason::not_possible_now, "result " + std::to_string(record.id) + " is " +
                                                 std::string{name(record.state)} + ", no longer " +
                                                 std::string{name(change.from)} + ": repeat the request"};
  TRY(const auto number, note(*database_, record.id, change.to, utc, change.by, change.remark));
  const bool is_accepted = change.to == State::accepted;
  Statement row{*database_,
                "UPDATE results SET state = ?, accepted_utc = ?, accepted_by = ?, retired_utc = ? WHERE id = ?"};
  row.bind(stored(change.to)).bind(is_accepted ? utc : record.accepted_utc);
  row.bind(is_accepted ? change.by : record.accepted_by).bind(change.to == State::retired ? utc : std::string_view{});
  TRY(row.bind(stored(record.id)).run());
  TRY(seal(*database_, record.id));
  return Transition{.number = number,
                    .result = record.id,
                    .method = record.method,
                    .binding = record.binding,
                    .to = change.to,
                    .utc = std::string{utc},
                    .by = change.by,
                    .remark = change.remark};
}

Outcome<std::vector<Transition>, Failure> Store::append(std::span<const Change> changes,
                                                        const std::optional<Proposal>& proposal, Id next_id,
                                                        std::string_view utc) {
  if (utc.empty()) return Failure{Reason::bad_argument, "a change needs its time (UTC)"};
  const auto appended = [&]() -> Outcome<std::vector<Transition>, Failure> {
    TRY(auto transaction, Transaction::begin(*database_));
    std::vector<Transition> transitions;
    if (proposal) {
      const auto& [binding, result, origin] = *proposal;
      const auto json = json::toJson(result);
      TRY(auto proposed, insert(binding, {State::proposed, result.method, json, {}}, utc, origin));
      if (proposed.result != next_id)
        return Failure{Reason::not_possible_now, "result " + std::to_string(next_id) +
                                                     " was proposed by somebody else meanwhile: repeat the request"};
      transitions.push_back(std::move(proposed));
    }
    for (const auto& each : changes) {
      TRY(auto changed, change(each, utc));
      transitions.push_back(std::move(changed));
    }
    TRY(transaction.commit());
    return transitions;
  }();
  // A row that is found damaged only now does not stand in the way of the next attempt.
  if (!appended && appended.error().reason == Reason::damaged) setDamagedRowsAside();
  return appended;
}

Outcome<void, Failure> Store::undo(std::span<const Change> changes) {
  TRY(auto transaction, Transaction::begin(*database_));
  for (const auto& change : changes) {
    TRY(const auto now, find(change.result));
    if (now.state != change.to)
      return Failure{Reason::not_possible_now,
                     "result " + std::to_string(now.id) + " is " + std::string{name(now.state)} + " already"};
    Statement newest{*database_,
                     "DELETE FROM transitions WHERE id = (SELECT max(id) FROM transitions WHERE result_id = ?)"};
    TRY(newest.bind(stored(now.id)).run());
    // One that is retired again was so since its last retirement; one that is only proposed again was never accepted.
    Statement row{*database_,
                  "UPDATE results SET state = ?2, retired_utc = CASE WHEN ?2 = 3 THEN (SELECT utc FROM transitions "
                  "WHERE result_id = ?1 AND state = 3 ORDER BY id DESC LIMIT 1) ELSE '' END, "
                  "accepted_utc = CASE WHEN ?2 = 0 THEN '' ELSE accepted_utc END, "
                  "accepted_by = CASE WHEN ?2 = 0 THEN '' ELSE accepted_by END WHERE id = ?1"};
    TRY(row.bind(stored(now.id)).bind(stored(change.from)).run());
    TRY(seal(*database_, now.id));
  }
  return transaction.commit();
}

Outcome<Contents, Failure> Store::load(Id after) {
  Contents contents;
  TRY(contents.heads, withoutDamage([&] { return readHeads(*database_, after); }));
  TRY(contents.transitions, readTransitions(*database_, {.count = kAllTransitions}, after));
  Statement dependences{*database_,
                        "SELECT result_id, rests_on FROM dependences WHERE result_id > ? AND checksum = row_sum(id, "
                        "result_id, rests_on) ORDER BY id"};
  dependences.bind(stored(after));
  while (true) {
    TRY(const auto row, dependences.step());
    if (!row) break;
    contents.dependences.push_back({static_cast<Id>(dependences.number(0)), static_cast<Id>(dependences.number(1))});
  }
  TRY(const auto last, database_->number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'results'"));
  contents.next_id = static_cast<Id>(last) + 1;
  return contents;
}

Outcome<Id, Failure> Store::propose(const Binding& binding, const metrology::Result& result, std::string_view dataset,
                                    std::string_view utc, const Origin& origin) {
  const Proposal alone{binding, result, origin};
  TRY(const auto ids, propose(std::span{&alone, 1}, dataset, utc));
  return ids.front();
}

Outcome<std::vector<Id>, Failure> Store::propose(std::span<const Proposal> proposals, std::string_view dataset,
                                                 std::string_view utc) {
  TRY(auto transaction, Transaction::begin(*database_));
  std::vector<Id> ids;
  for (const auto& [binding, result, origin] : proposals) {
    const auto json = json::toJson(result);
    TRY(const auto proposed, insert(binding, {State::proposed, result.method, json, dataset}, utc, origin));
    ids.push_back(proposed.result);
  }
  TRY(transaction.commit());
  return ids;
}

Outcome<Id, Failure> Store::refuse(const Binding& binding, std::string_view method, const metrology::Refusal& refusal,
                                   std::string_view dataset, std::string_view utc) {
  TRY(auto transaction, Transaction::begin(*database_));
  TRY(const auto refused, insert(binding, {State::refused, method, json::toJson(refusal), dataset}, utc, {}));
  TRY(transaction.commit());
  return refused.result;
}

Outcome<Record, Failure> Store::find(Id id) {
  Statement statement{*database_, select("WHERE id = ?")};
  TRY(auto record, readAtMostOne(statement.bind(stored(id))));
  if (record) return std::move(*record);
  return Failure{Reason::unknown_result,
                 "there is no result " + std::to_string(id) + "; `probebox history` names those that there are"};
}

Outcome<std::vector<Record>, Failure> Store::resultsAfter(Id after, std::size_t count) {
  return withoutDamage([&] {
    Statement statement{*database_, select("WHERE state < 4 AND id > ? ORDER BY id LIMIT ?")};
    return readRecords(statement.bind(stored(after)).bind(static_cast<std::int64_t>(count)));
  });
}

Outcome<Id, Failure> Store::idBeforeNewest(std::size_t count) {
  Statement statement{*database_, "SELECT id FROM results WHERE state < 4 ORDER BY id DESC LIMIT 1 OFFSET ?"};
  TRY(const auto row, statement.bind(static_cast<std::int64_t>(count)).step());
  return row ? static_cast<Id>(statement.number(0)) : Id{};
}

Outcome<std::string, Failure> Store::dataset(Id id) {
  TRY(find(id));
  Statement statement{*database_, "SELECT json, checksum = row_sum(result_id, json) FROM datasets WHERE result_id = ?"};
  TRY(const auto row, statement.bind(stored(id)).step());
  if (!row) return std::string{};
  if (statement.number(1) != 1)
    return Failure{Reason::damaged, "the data of result " + std::to_string(id) + " are damaged on the disk"};
  return statement.text(0);
}

Outcome<std::vector<Transition>, Failure> Store::history(Id id) {
  return history(HistoryRange{.result = id, .subject = {}, .after = 0, .count = kAllTransitions});
}

Outcome<std::vector<Transition>, Failure> Store::history(const HistoryRange& range) {
  return readTransitions(*database_, range, 0);
}

Outcome<std::vector<Dependence>, Failure> Store::restsOn(Id id) {
  Statement statement{*database_,
                      "SELECT d.rests_on, coalesce(r.subject, '') FROM dependences d "
                      "LEFT JOIN results r ON r.id = d.rests_on WHERE d.result_id = ? "
                      "AND d.checksum = row_sum(d.id, d.result_id, d.rests_on) ORDER BY d.rests_on"};
  statement.bind(stored(id));
  std::vector<Dependence> all;
  while (true) {
    TRY(const auto row, statement.step());
    if (!row) return all;
    all.push_back({.id = static_cast<Id>(statement.number(0)), .subject = statement.text(1)});
  }
}

}  // namespace probebox::store
