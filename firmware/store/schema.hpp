#pragma once
#include <string>

#include "firmware/store/database.hpp"

namespace probebox::store {

// "pbox": SQLite's application id, which identifies the program of a file.
inline constexpr std::int64_t kApplicationId = 0x70626f78;

// Schema versions that this program can read: 1 up to and with this one.
std::int64_t knownSchema();

// Refuses files of other programs or of a newer schema, then checks every page. Changes nothing.
Outcome<void, Failure> inspect(Database& database);

// Updates the file to the newest schema, all steps in one transaction. Returns a notice for a person, or an empty text.
Outcome<std::string, Failure> migrate(Database& database);

// Assigns every result that an earlier version stored to the subject of the quantity that it found (subjects.cpp).
// Damaged rows stay unchanged. Returns a notice for a person, or an empty text. Call inside a transaction.
Outcome<std::string, Failure> assignSubjects(Database& database);

}  // namespace probebox::store
