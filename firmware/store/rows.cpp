#include "firmware/store/rows.hpp"

#include <utility>

#include "firmware/json/result_json.hpp"

namespace probebox::store {
namespace {

constexpr std::string_view kSelect =
    "SELECT id, state, method, subject, probe, machine, mounting, result_json, proposed_utc, accepted_utc, "
    "accepted_by, retired_utc, checksum = row_sum(id, state, method, subject, probe, machine, mounting, result_json, "
    "proposed_utc, accepted_utc, accepted_by, retired_utc) FROM results ";
constexpr int kWhole = 12;  // the column that says so

Failure damagedRow(Id id) {
  return {Reason::damaged,
          "result " + std::to_string(id) +
              " is damaged: what the disk has does not match its checksum; calibrate again, or go back by its subject "
              "(probebox rollback SUBJECT --by NAME)"};
}

}  // namespace

Outcome<Contents::Head, Failure> readHead(const Statement& row) {
  Contents::Head head{.id = static_cast<Id>(row.number(0)),
                      .state = static_cast<State>(row.number(1)),
                      .binding = {row.text(3), row.text(4), row.text(5), row.text(6)},
                      .accepted_by = row.text(10)};
  if (row.number(1) == kDamagedState || row.number(kWhole) != 1) return damagedRow(head.id);
  return head;
}

namespace {

Outcome<Record, Failure> readRecord(const Statement& row) {
  TRY(auto head, readHead(row));
  Record record{.id = head.id,
                .state = head.state,
                .method = row.text(2),
                .binding = std::move(head.binding),
                .content = metrology::Refusal{},
                .proposed_utc = row.text(8),
                .accepted_utc = row.text(9),
                .accepted_by = std::move(head.accepted_by),
                .retired_utc = row.text(11)};
  const std::string json = row.text(7);
  const auto keep = [&](auto content) -> Outcome<Record, Failure> {
    if (!content) return Failure{Reason::damaged, "result " + std::to_string(record.id) + ": " + content.error().what};
    record.content = std::move(content).value();
    return std::move(record);
  };
  return record.state == State::refused ? keep(json::refusalFromJson(json)) : keep(json::resultFromJson(json));
}

}  // namespace

std::int64_t stored(State state) {
  return static_cast<std::int64_t>(state);
}
std::int64_t stored(Id id) {
  return static_cast<std::int64_t>(id);
}

std::string select(std::string_view condition) {
  return std::string{kSelect}.append(condition);
}

Outcome<std::vector<Record>, Failure> readRecords(Statement& statement) {
  std::vector<Record> records;
  while (true) {
    TRY(const auto row, statement.step());
    if (!row) return records;
    TRY(auto record, readRecord(statement));
    records.push_back(std::move(record));
  }
}

Outcome<std::optional<Record>, Failure> readAtMostOne(Statement& statement) {
  TRY(auto records, readRecords(statement));
  if (records.empty()) return std::optional<Record>{};
  return std::optional<Record>{std::move(records.front())};
}

Statement& bind(Statement& statement, const Binding& binding) {
  const auto& [subject, probe, machine, mounting] = binding;
  return statement.bind(subject).bind(probe).bind(machine).bind(mounting);
}

Outcome<std::uint64_t, Failure> note(Database& database, Id id, State to, std::string_view utc, std::string_view by,
                                     std::string_view remark) {
  Statement statement{database, "INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (?, ?, ?, ?)"};
  TRY(statement.bind(stored(id)).bind(stored(to)).bind(utc).bind(by).run());
  const auto number = database.lastId();
  Statement sum{database, "UPDATE transitions SET checksum = row_sum(id, result_id, state, utc, by_whom) WHERE id = ?"};
  TRY(sum.bind(number).run());
  if (remark.empty()) return static_cast<std::uint64_t>(number);
  Statement said{database, "INSERT INTO remarks (transition_id, text) VALUES (?, ?)"};
  TRY(said.bind(number).bind(remark).run());
  Statement seal{database, "UPDATE remarks SET checksum = row_sum(transition_id, text) WHERE transition_id = ?"};
  TRY(seal.bind(number).run());
  return static_cast<std::uint64_t>(number);
}

Outcome<void, Failure> seal(Database& database, Id id) {
  Statement statement{database,
                      "UPDATE results SET checksum = row_sum(id, state, method, subject, probe, machine, mounting, "
                      "result_json, proposed_utc, accepted_utc, accepted_by, retired_utc) WHERE id = ?"};
  return statement.bind(stored(id)).run();
}

Outcome<void, Failure> markDamaged(Database& database) {
  std::vector<Id> damaged;
  Statement rows{database, select("WHERE state <> 5")};
  while (true) {
    TRY(const auto row, rows.step());
    if (!row) break;
    if (!readRecord(rows)) damaged.push_back(static_cast<Id>(rows.number(0)));
  }
  for (const auto id : damaged) {
    Statement statement{database, "UPDATE results SET state = 5 WHERE id = ?"};
    if (const auto done = statement.bind(stored(id)).run(); !done) return done;
  }
  return database.run(
      "UPDATE transitions SET state = 5 WHERE state <> 5 AND checksum <> row_sum(id, result_id, state, utc, by_whom)");
}

namespace {

constexpr const char* kRemedy = ": calibrate again, or go back with `probebox rollback SUBJECT --by NAME`";

Outcome<void, Failure> addDamagedResults(Database& database, std::vector<std::string>& all) {
  Statement rows{database,
                 "SELECT id, subject FROM results r WHERE state = 5 AND NOT EXISTS (SELECT 1 FROM results later "
                 "WHERE later.id > r.id AND later.subject = r.subject AND later.state IN (1, 2, 3)) ORDER BY id"};
  while (true) {
    TRY(const auto row, rows.step());
    if (!row) return {};
    all.push_back("result " + std::to_string(rows.number(0)) + " about " + rows.text(1) +
                  " is damaged on the disk, and is not in force" + kRemedy);
  }
}

// Numbers are given without a gap and never deleted.
Outcome<void, Failure> addMissingResults(Database& database, std::vector<std::string>& all) {
  Statement rows{
      database,
      "SELECT id, before FROM (SELECT id, lag(id, 1, 0) OVER (ORDER BY id) AS before FROM results UNION ALL "
      "SELECT seq + 1, (SELECT coalesce(max(id), 0) FROM results) FROM sqlite_sequence WHERE name = 'results') "
      "WHERE id > before + 1 ORDER BY id"};
  std::string missing;
  while (true) {
    TRY(const auto row, rows.step());
    if (!row) break;
    const auto first = rows.number(1) + 1, last = rows.number(0) - 1;
    missing.append(missing.empty() ? "" : ", ").append(std::to_string(first));
    if (last > first) missing.append(" to ").append(std::to_string(last));
  }
  if (!missing.empty()) all.push_back("results that were stored are lost: " + missing + kRemedy);
  return {};
}

}  // namespace

Outcome<std::vector<std::string>, Failure> damagedRows(Database& database) {
  std::vector<std::string> all;
  TRY(addDamagedResults(database, all));
  TRY(addMissingResults(database, all));
  TRY(const auto transitions, database.number("SELECT count(*) FROM transitions WHERE state = 5"));
  if (transitions > 0)
    all.push_back("entries of the history of results that are damaged and not shown: " + std::to_string(transitions));
  TRY(const auto beside,
      database.number("SELECT (SELECT count(*) FROM remarks WHERE checksum <> row_sum(transition_id, text)) + "
                      "(SELECT count(*) FROM dependences WHERE checksum <> row_sum(id, result_id, rests_on))"));
  if (beside > 0)
    all.push_back("remarks on results, or notes of what they rest on, that are damaged and not shown: " +
                  std::to_string(beside));
  return all;
}

}  // namespace probebox::store
