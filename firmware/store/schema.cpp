#include "firmware/store/schema.hpp"

#include <array>

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
};

Failure foreign(const Database& database) {
  return {Reason::foreign_file, database.path() + " is a database of another program; name another state directory"};
}

Failure newer(const Database& database, std::int64_t schema) {
  return {Reason::newer_schema,
          database.path() + " has schema " + std::to_string(schema) + " and this program knows up to " +
              std::to_string(knownSchema()) +
              ": it was written by a newer version; update this one, or name another state directory"};
}

Outcome<Done, Failure> checkPages(Database& database) {
  const auto verdict = database.text("PRAGMA integrity_check(1)");
  if (!verdict) return verdict.error();
  if (verdict.value() == "ok") return Done{};
  return Failure{Reason::damaged, database.path() + " is damaged (" + verdict.value() + ")"};
}

}  // namespace

std::int64_t knownSchema() {
  return static_cast<std::int64_t>(kSteps.size());
}

Outcome<Done, Failure> inspect(Database& database) {
  const auto owner = database.number("PRAGMA application_id");
  if (!owner) return owner.error();
  const auto tables = database.number("SELECT count(*) FROM sqlite_master");
  if (!tables) return tables.error();
  const bool empty = owner.value() == 0 && tables.value() == 0;
  if (!empty && owner.value() != kApplicationId) return foreign(database);
  const auto schema = database.number("PRAGMA user_version");
  if (!schema) return schema.error();
  if (schema.value() > knownSchema()) return newer(database, schema.value());
  return checkPages(database);
}

Outcome<Done, Failure> migrate(Database& database) {
  auto transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  // Read inside the transaction: another process may have migrated the file while this one waited for the lock.
  const auto schema = database.number("PRAGMA user_version");
  if (!schema) return schema.error();
  for (auto step = static_cast<std::size_t>(schema.value()); step < kSteps.size(); ++step) {
    if (const auto done = database.run(kSteps[step]); !done) return done.error();
  }
  const std::string mark = "PRAGMA application_id = " + std::to_string(kApplicationId) +
                           "; PRAGMA user_version = " + std::to_string(knownSchema());
  if (const auto done = database.run(mark.c_str()); !done) return done.error();
  return transaction->commit();
}

}  // namespace probebox::store
