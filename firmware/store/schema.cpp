#include "firmware/store/schema.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace probebox::store {
namespace {

// Step n brings a file from schema n to n + 1. A step that has been released never changes: add one at the end.
constexpr std::array kSteps{
    R"sql(
      CREATE TABLE results (
        id INTEGER PRIMARY KEY AUTOINCREMENT,  -- never given twice, also not after a deletion
        state INTEGER NOT NULL,
        method TEXT NOT NULL,
        probe TEXT NOT NULL,
        machine TEXT NOT NULL,
        mounting TEXT NOT NULL,
        result_json TEXT NOT NULL,
        dataset_json TEXT NOT NULL,
        proposed_utc TEXT NOT NULL,
        accepted_utc TEXT NOT NULL DEFAULT '',
        accepted_by TEXT NOT NULL DEFAULT '',
        retired_utc TEXT NOT NULL DEFAULT ''
      ) STRICT;
      CREATE UNIQUE INDEX one_active_result ON results (method, probe, machine, mounting) WHERE state = 2;
      CREATE TABLE transitions (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        result_id INTEGER NOT NULL REFERENCES results (id),
        state INTEGER NOT NULL,
        utc TEXT NOT NULL,
        by_whom TEXT NOT NULL
      ) STRICT;
      CREATE INDEX transitions_of_a_result ON transitions (result_id);
    )sql",
    // Several methods answer one question: what retires what goes by the subject. Of results that were active side by
    // side for one subject, the one accepted last stays.
    R"sql(
      ALTER TABLE results ADD COLUMN subject TEXT NOT NULL DEFAULT '';
      UPDATE results SET subject = CASE
        WHEN method LIKE 'delay-%' THEN 'delay'
        WHEN method IN ('centreline', 'centreline-limited-access', 'c-axis-alignment') THEN 'centreline'
        ELSE method END;
      INSERT INTO transitions (result_id, state, utc, by_whom)
        SELECT older.id, 3, max(newer.accepted_utc), '' FROM results older JOIN results newer
          ON older.state = 2 AND newer.state = 2 AND newer.subject = older.subject AND newer.probe = older.probe
          AND newer.machine = older.machine AND newer.mounting = older.mounting
          AND (newer.accepted_utc, newer.id) > (older.accepted_utc, older.id)
        GROUP BY older.id;
      UPDATE results SET state = 3,
        retired_utc = (SELECT utc FROM transitions t WHERE t.result_id = results.id AND t.state = 3)
        WHERE state = 2 AND id IN (SELECT result_id FROM transitions WHERE state = 3);
      DROP INDEX one_active_result;
      CREATE UNIQUE INDEX one_active_result ON results (subject, probe, machine, mounting) WHERE state = 2;
      CREATE UNIQUE INDEX one_waiting_result ON results (subject, probe, machine, mounting) WHERE state = 1;
    )sql",
    // Datasets have a table of their own: they are large, seldom read and not kept for ever.
    R"sql(
      CREATE TABLE datasets (
        result_id INTEGER PRIMARY KEY REFERENCES results (id),
        json TEXT NOT NULL
      ) STRICT;
      INSERT INTO datasets SELECT id, dataset_json FROM results WHERE dataset_json <> '';
      ALTER TABLE results DROP COLUMN dataset_json;
    )sql",
    // The correction that was served last: one row.
    R"sql(
      CREATE TABLE standing (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        x_mm REAL NOT NULL,
        y_mm REAL NOT NULL,
        z_mm REAL NOT NULL,
        utc TEXT NOT NULL
      ) STRICT;
    )sql",
    // Every row carries a checksum over all that it says: what the disk has turned into something else is not believed.
    R"sql(
      ALTER TABLE results ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
      UPDATE results SET checksum = row_sum(id, state, method, subject, probe, machine, mounting, result_json,
        proposed_utc, accepted_utc, accepted_by, retired_utc);
      ALTER TABLE transitions ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
      UPDATE transitions SET checksum = row_sum(id, result_id, state, utc, by_whom);
      ALTER TABLE datasets ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
      UPDATE datasets SET checksum = row_sum(result_id, json);
      ALTER TABLE standing ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
      UPDATE standing SET checksum = row_sum(id, x_mm, y_mm, z_mm, utc);
    )sql",
    // Results that a result was computed with, and remarks made with a change of state. Tables of their own: a damaged
    // file of an earlier version is salvaged by the same columns.
    R"sql(
      CREATE TABLE dependences (
        id INTEGER PRIMARY KEY,
        result_id INTEGER NOT NULL,
        rests_on INTEGER NOT NULL,
        checksum INTEGER NOT NULL DEFAULT 0
      ) STRICT;
      CREATE INDEX dependences_of_a_result ON dependences (result_id);
      CREATE TABLE remarks (
        transition_id INTEGER PRIMARY KEY,
        text TEXT NOT NULL,
        checksum INTEGER NOT NULL DEFAULT 0
      ) STRICT;
    )sql",
};
constexpr std::int64_t kSubjectsByQuantity = 6;  // schemas before it have one subject for several quantities

// Tables, their columns and indexes, as text: two files of one schema agree, whoever made them.
constexpr const char* kShape =
    "SELECT group_concat(part, ';') FROM (SELECT part FROM ("
    "SELECT m.name || '.' || c.name || ' ' || c.type || ' ' || c.\"notnull\" || c.pk AS part FROM sqlite_master m "
    "JOIN pragma_table_info(m.name) c WHERE m.type = 'table' AND m.name NOT LIKE 'sqlite_%' "
    "UNION ALL SELECT m.name || ' ' || m.tbl_name || ' ' || c.name FROM sqlite_master m "
    "JOIN pragma_index_info(m.name) c WHERE m.type = 'index') ORDER BY part)";

const std::string& newestShape() {
  static const std::string shape = [] {
    auto database = Database::inMemory();
    if (!database || !migrate(*database)) return std::string{};
    const auto text = database->text(kShape);
    return text ? *text : std::string{};
  }();
  return shape;
}

Failure foreign(const Database& database) {
  return {Reason::foreign_file, database.path() + " is a database of another program"};
}

Failure newer(const Database& database, std::int64_t schema) {
  return {Reason::newer_schema,
          database.path() + " has schema " + std::to_string(schema) + " and this program knows up to " +
              std::to_string(knownSchema()) +
              ": it was written by a newer version: install that version again (probebox update, or its package)"};
}

Outcome<void, Failure> checkPages(Database& database) {
  TRY(auto verdict, database.text("PRAGMA integrity_check(1)"));
  std::ranges::replace(verdict, '\n', ' ');  // it goes into a line of the log
  if (verdict == "ok") return {};
  // A page that cannot be read is the disk's fault, and says nothing about the file: it may be sound tomorrow.
  if (verdict.find("error code=") != std::string::npos) {
    return Failure{Reason::unavailable,
                   database.path() + " cannot be read (" + verdict + "); check the disk; nothing was changed"};
  }
  return Failure{Reason::damaged, database.path() + " is damaged (" + verdict + ")"};
}

}  // namespace

std::int64_t knownSchema() {
  return static_cast<std::int64_t>(kSteps.size());
}

Outcome<void, Failure> inspect(Database& database) {
  TRY(const auto owner, database.number("PRAGMA application_id"));
  TRY(const auto tables, database.number("SELECT count(*) FROM sqlite_master"));
  const bool empty = owner == 0 && tables == 0;
  if (!empty && owner != kApplicationId) return foreign(database);
  TRY(const auto schema, database.number("PRAGMA user_version"));
  TRY(const auto shape, database.text(kShape));
  const bool as_ours = shape == newestShape();
  if (schema > knownSchema() && !as_ours) return newer(database, schema);
  // A number that its own tables belie is damage, and so are tables that nobody has made so.
  if (!empty && (schema == knownSchema()) != as_ours)
    return Failure{Reason::damaged, database.path() + " is damaged (its tables are not those of its schema)"};
  return checkPages(database);
}

Outcome<std::string, Failure> migrate(Database& database) {
  TRY(auto transaction, Transaction::begin(database));
  // Read inside the transaction: another process may have migrated the file while this one waited for the lock.
  TRY(const auto schema, database.number("PRAGMA user_version"));
  // Nothing is written where nothing is to be done: a full disk does not keep a sound store from being opened.
  if (schema == knownSchema()) return std::string{};
  for (auto step = static_cast<std::size_t>(schema); step < kSteps.size(); ++step) {
    TRY(database.run(kSteps[step]));
  }
  std::string told;
  if (schema < kSubjectsByQuantity) {
    auto assigned = assignSubjects(database);
    if (!assigned) return assigned;
    told = std::move(*assigned);
  }
  const std::string mark = "PRAGMA application_id = " + std::to_string(kApplicationId) +
                           "; PRAGMA user_version = " + std::to_string(knownSchema());
  TRY(database.run(mark.c_str()));
  TRY(transaction.commit());
  return told;
}

}  // namespace probebox::store
