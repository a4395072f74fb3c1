#pragma once
#include <cstdint>
#include <string>

#include "firmware/store/database.hpp"

// A copy of the file as an earlier version left it, beside it: PATH.schema-N. The version that made it cannot read the
// file once a newer one has changed its schema, and a box that goes back to that version needs its results.
namespace probebox::store {

// Keeps a copy of the file, which has this schema, and removes earlier ones. The copy is on the disk when it returns.
Outcome<void, Failure> keepCopyBefore(Database& database, std::int64_t schema);

// The newest copy of PATH that this program can read; empty when there is none.
std::string copyBefore(const std::string& path);

// True when no result has come into force or out of it in the file since the copy was made. False when that cannot be
// told.
bool holdsSince(const std::string& path, const std::string& copy);

}  // namespace probebox::store
