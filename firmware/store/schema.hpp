#pragma once
#include <cstdint>

#include "firmware/store/database.hpp"

namespace probebox::store {

// "pbox": SQLite's application id, which identifies the program of a file.
inline constexpr std::int64_t kApplicationId = 0x70626f78;
// Version of the tables (SQLite's user_version).
inline constexpr std::int64_t kSchema = 1;

// Refuses files of other programs or of another schema, then checks every page. Changes nothing.
Outcome<void, Failure> inspect(Database& database);

// Makes the tables in an empty file, in one transaction. Writes nothing where they are.
Outcome<void, Failure> makeTables(Database& database);

}  // namespace probebox::store
