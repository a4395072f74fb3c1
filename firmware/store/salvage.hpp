#pragma once
#include <cstddef>
#include <string>

#include "firmware/store/database.hpp"

namespace probebox::store {

// Copies every row of a damaged file that is whole by its checksum into a new, empty store, under its old number. Works
// on a copy of the file beside it, whose header is made good: the damaged file stays as it is. Gives the number of
// results that were taken over.
std::size_t salvage(const std::string& damaged, Database& into);

}  // namespace probebox::store
