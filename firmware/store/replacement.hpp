#pragma once
#include <string>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

// Replaces an unusable store PATH by a new one. However a start ends, the next one finds the old file and begins again,
// or the new one with all that it got. Files beside PATH meanwhile:
//   PATH.new       the new store, while it is made
//   PATH.repaired  PATH.new is whole: where the old file goes, and the notice for a person, until that is given
//   PATH.salvage   copy of the old file from which rows are read
namespace probebox::store {

std::string nameOfNew(const std::string& path);
std::string nameOfSalvage(const std::string& path);

// PATH.new is whole, on the disk and closed: puts it in the place of PATH, which is kept as `aside`.
Outcome<void, Failure> replaceByNew(const std::string& path, const std::string& aside, const std::string& notice);

// Finishes what an interrupted replaceByNew() has left. Returns the notice of a replacement that is done and was not
// told yet; or an empty text.
Outcome<std::string, Failure> finishReplacement(const std::string& path);

// True when PATH is not there, and PATH.new is what it is to be.
bool waitsForItsName(const std::string& path);

// Removes the files beside PATH. Nothing while PATH is not there.
void discardReplacement(const std::string& path);

}  // namespace probebox::store
