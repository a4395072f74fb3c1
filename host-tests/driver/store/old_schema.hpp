#pragma once
#include <string>

#include "firmware/json/result_json.hpp"
#include "scratch.hpp"

// Files as earlier releases wrote them. Frozen: such files are in the field.
namespace probebox::store {

inline constexpr const char* kSchema1 = R"sql(
  CREATE TABLE results (
    id INTEGER PRIMARY KEY AUTOINCREMENT, state INTEGER NOT NULL, method TEXT NOT NULL, probe TEXT NOT NULL,
    machine TEXT NOT NULL, mounting TEXT NOT NULL, result_json TEXT NOT NULL, dataset_json TEXT NOT NULL,
    proposed_utc TEXT NOT NULL, accepted_utc TEXT NOT NULL DEFAULT '', accepted_by TEXT NOT NULL DEFAULT '',
    retired_utc TEXT NOT NULL DEFAULT ''
  ) STRICT;
  CREATE UNIQUE INDEX one_active_result ON results (method, probe, machine, mounting) WHERE state = 2;
  CREATE TABLE transitions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, result_id INTEGER NOT NULL REFERENCES results (id),
    state INTEGER NOT NULL, utc TEXT NOT NULL, by_whom TEXT NOT NULL
  ) STRICT;
  CREATE INDEX transitions_of_a_result ON transitions (result_id);
  PRAGMA application_id = 1885499256;
  PRAGMA user_version = 1;
)sql";

// A result of kBinding's place in schema 1: proposed at T6, accepted by Ada at T7, retired at T8, as far as its state.
inline std::string insertOld(int id, int state, const std::string& method, const std::string& dataset) {
  const auto at = [](bool happened, const char* utc) { return happened ? "'" + std::string{utc} + "'" : "''"; };
  const auto number = std::to_string(id);
  const std::string six = "2026-11-21T06:00:00Z", seven = "2026-11-21T07:00:00Z", eight = "2026-11-21T08:00:00Z";
  std::string sql = "INSERT INTO results VALUES (" + number + ", " + std::to_string(state) + ", '" + method +
                    "', 'P-1001', 'mill 3', 'spindle', '" + json::toJson(delayOf(0.1 / 3)) + "', '" + dataset + "', '" +
                    six + "', " + at(state >= 2, seven.c_str()) + ", " + at(state >= 2, "Ada") + ", " +
                    at(state == 3, eight.c_str()) + ");";
  const auto note = [&](int to, const std::string& utc, const char* by) {
    sql += "INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (" + number + ", " + std::to_string(to) +
           ", '" + utc + "', '" + by + "');";
  };
  note(0, six, "");
  if (state >= 2) {
    note(1, seven, "Ada");
    note(2, seven, "Ada");
  }
  if (state == 3) note(3, eight, "Ada");
  return sql;
}

}  // namespace probebox::store
