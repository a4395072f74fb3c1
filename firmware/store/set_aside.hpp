#pragma once
#include <string>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// Renames an unusable file, with its journal, to PATH.REASON-1 or the first free number; deletes nothing. Returns the
// new name; an error when the folder does not permit it.
Outcome<std::string, Failure> setAside(const std::string& path, const std::string& reason);

}  // namespace probebox::store
