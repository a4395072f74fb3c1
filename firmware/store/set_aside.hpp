#pragma once
#include <string>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// Whether an earlier start has had a file: one that is gone then is lost.
enum class Before { perhaps, had_it };

// True also for a link that leads nowhere.
bool isThere(const std::string& path);

// Whether an open file still has its name: nobody has removed it, or put another one in its place.
bool isStillAt(const std::string& path, int descriptor);

// Whether it can be opened without waiting for others, as a pipe cannot: an ordinary file, or nothing yet.
bool isOrdinaryOrAbsent(const std::string& path);

// Puts the folder's names on the disk. True also where the file system does not sync folders by themselves.
bool syncFolderOf(const std::string& path);

// The name under which an unusable file is kept: PATH.REASON-1 or the first free number, or the one that an interrupted
// attempt has given it.
std::string asideNameOf(const std::string& path, const std::string& reason);

// Gives the name PATH to FRESH, whole and on the disk. The unusable file keeps its bytes, and its journal, under the
// name `aside`; nothing is deleted. Where the file system has links there is no instant without a file PATH; elsewhere
// the call is repeated after an interruption. Error: FRESH is still there.
Outcome<void, Failure> putInPlace(const std::string& fresh, const std::string& path, const std::string& aside);

}  // namespace probebox::store
