#pragma once
#include <cstddef>
#include <string>

#include "firmware/store/database.hpp"

namespace probebox::store {

// Copies every row of a damaged file that matches its checksum into a new, empty store, under its old number. Works on
// a copy beside the file, whose header is repaired; the damaged file stays unchanged. What is damaged is left out;
// an error is the disk's: no room for the copy or the rows, no right to read. Returns the number of results recovered.
Outcome<std::size_t, Failure> salvage(const std::string& damaged, Database& into);

// The same into memory, and writes nothing to the disk. Refuses a file beside a journal, which may have a transaction
// in part, and one of which nothing is whole.
Outcome<Database, Failure> salvagedInMemory(const std::string& damaged);

}  // namespace probebox::store
