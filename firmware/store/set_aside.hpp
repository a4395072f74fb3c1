#pragma once
#include <string>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// Renames a file that cannot be used to PATH.REASON-1, or the first number that is free, with its journal; deletes
// nothing. Gives the new name; an error when the folder does not let it.
Outcome<std::string, Failure> setAside(const std::string& path, const std::string& reason);

}  // namespace probebox::store
