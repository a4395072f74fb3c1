#pragma once
#include <cstddef>
#include <string>

#include "firmware/store/database.hpp"

namespace probebox::store {

// Copies every row of a damaged file that matches its checksum into a new, empty store, under its old number. Works on
// a copy beside the file, whose header is repaired; the damaged file stays unchanged. Returns the number of recovered
// results.
std::size_t salvage(const std::string& damaged, Database& into);

}  // namespace probebox::store
