#include "firmware/store/schema.hpp"

#include <algorithm>
#include <string>

namespace probebox::store {
namespace {

constexpr const char* kMakeTables = R"sql(
  CREATE TABLE results (
    id INTEGER PRIMARY KEY AUTOINCREMENT,  -- never given twice, also not after a deletion
    state INTEGER NOT NULL,
    method TEXT NOT NULL,
    subject TEXT NOT NULL,
    probe TEXT NOT NULL,
    machine TEXT NOT NULL,
    mounting TEXT NOT NULL,
    result_json TEXT NOT NULL,
    proposed_utc TEXT NOT NULL,
    accepted_utc TEXT NOT NULL DEFAULT '',
    accepted_by TEXT NOT NULL DEFAULT '',
    retired_utc TEXT NOT NULL DEFAULT '',
    checksum INTEGER NOT NULL DEFAULT 0  -- over all that the row says, as in each table
  ) STRICT;
  CREATE UNIQUE INDEX one_active_result ON results (subject, probe, machine, mounting) WHERE state = 2;
  CREATE UNIQUE INDEX one_waiting_result ON results (subject, probe, machine, mounting) WHERE state = 1;
  CREATE TABLE transitions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    result_id INTEGER NOT NULL REFERENCES results (id),
    state INTEGER NOT NULL,
    utc TEXT NOT NULL,
    by_whom TEXT NOT NULL,
    checksum INTEGER NOT NULL DEFAULT 0
  ) STRICT;
  CREATE INDEX transitions_of_a_result ON transitions (result_id);
  CREATE TABLE remarks (
    transition_id INTEGER PRIMARY KEY,
    text TEXT NOT NULL,
    checksum INTEGER NOT NULL DEFAULT 0
  ) STRICT;
  -- Datasets are large, seldom read and not kept for ever.
  CREATE TABLE datasets (
    result_id INTEGER PRIMARY KEY REFERENCES results (id),
    json TEXT NOT NULL,
    checksum INTEGER NOT NULL DEFAULT 0
  ) STRICT;
  -- Results that a result was computed with.
  CREATE TABLE dependences (
    id INTEGER PRIMARY KEY,
    result_id INTEGER NOT NULL,
    rests_on INTEGER NOT NULL,
    checksum INTEGER NOT NULL DEFAULT 0
  ) STRICT;
  CREATE INDEX dependences_of_a_result ON dependences (result_id);
)sql";

// Tables, their columns and indexes, as text: two files of one schema agree, whoever made them.
constexpr const char* kShape =
    "SELECT group_concat(part, ';') FROM (SELECT part FROM ("
    "SELECT m.name || '.' || c.name || ' ' || c.type || ' ' || c.\"notnull\" || c.pk AS part FROM sqlite_master m "
    "JOIN pragma_table_info(m.name) c WHERE m.type = 'table' AND m.name NOT LIKE 'sqlite_%' "
    "UNION ALL SELECT m.name || ' ' || m.tbl_name || ' ' || c.name FROM sqlite_master m "
    "JOIN pragma_index_info(m.name) c WHERE m.type = 'index') ORDER BY part)";

const std::string& ownShape() {
  static const std::string shape = [] {
    auto database = Database::inMemory();
    if (!database || !makeTables(*database)) return std::string{};
    const auto text = database->text(kShape);
    return text ? *text : std::string{};
  }();
  return shape;
}

Failure foreign(const Database& database) {
  return {Reason::foreign_file, database.path() + " is a database of another program"};
}

Failure ofAnotherVersion(const Database& database, std::int64_t schema) {
  return {Reason::other_schema, database.path() + " has another schema (" + std::to_string(schema) +
                                    "): it was written by another version of probebox; install that version again, or "
                                    "move the file away and calibrate again"};
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

Outcome<void, Failure> inspect(Database& database) {
  TRY(const auto owner, database.number("PRAGMA application_id"));
  TRY(const auto tables, database.number("SELECT count(*) FROM sqlite_master"));
  const bool empty = owner == 0 && tables == 0;
  if (!empty && owner != kApplicationId) return foreign(database);
  TRY(const auto schema, database.number("PRAGMA user_version"));
  TRY(const auto shape, database.text(kShape));
  const bool as_ours = shape == ownShape();
  if (schema > kSchema && !as_ours) return ofAnotherVersion(database, schema);
  // A number that its own tables belie is damage, and so are tables that nobody has made so.
  if (!empty && (schema != kSchema || !as_ours))
    return Failure{Reason::damaged, database.path() + " is damaged (its tables are not those of its schema)"};
  return checkPages(database);
}

Outcome<void, Failure> makeTables(Database& database) {
  TRY(auto transaction, Transaction::begin(database));
  // Read inside the transaction: another process may have made them while this one waited for the lock.
  TRY(const auto schema, database.number("PRAGMA user_version"));
  // Nothing is written where nothing is to be done: a full disk does not keep a sound store from being opened.
  if (schema == kSchema) return {};
  TRY(database.run(kMakeTables));
  const std::string mark = "PRAGMA application_id = " + std::to_string(kApplicationId) +
                           "; PRAGMA user_version = " + std::to_string(kSchema);
  TRY(database.run(mark.c_str()));
  return transaction.commit();
}

}  // namespace probebox::store
