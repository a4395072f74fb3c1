#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/store/database.hpp"
#include "firmware/store/record.hpp"

// Conversion between records and table rows; used by the store only.
namespace probebox::store {

std::int64_t stored(State state);
std::int64_t stored(Id id);

// A query for whole records.
std::string select(std::string_view condition);
// Of a row of select(), without the values of the result.
Outcome<Contents::Head, Failure> readHead(const Statement& row);
Outcome<std::vector<Record>, Failure> readRecords(Statement& statement);
Outcome<std::optional<Record>, Failure> readAtMostOne(Statement& statement);

// Values of a binding, in the order subject, probe, machine, mounting.
Statement& bind(Statement& statement, const Binding& binding);

// Updates the checksum of a changed row. Only for rows that were read and found intact in this transaction.
Outcome<void, Failure> seal(Database& database, Id id);

// Marks every row that does not match its checksum, so that it is ignored everywhere.
Outcome<void, Failure> markDamaged(Database& database);

// One sentence with its remedy for each damaged or missing row, except for results that a later accepted one of the
// same subject has replaced.
Outcome<std::vector<std::string>, Failure> damagedRows(Database& database);

// Stores a transition, and returns its number.
Outcome<std::uint64_t, Failure> note(Database& database, Id id, State to, std::string_view utc, std::string_view by,
                                     std::string_view remark);

}  // namespace probebox::store
