#pragma once
#include <filesystem>

#include "host-tests/faults/supervised.hpp"

namespace probebox::faults {

// What a box keeps in its state directory, through a boot and one of each command that changes it: results proposed,
// accepted at once and during a cut, rolled back, refused; inhibits of a controller and a person, word order, the
// identity of the box, bounds of the correction and the correction that is served; and a regular end. It announces each
// change, does it, and says how it came out (announcements.hpp).
void runStoreRoom(const std::filesystem::path& folder, const Say& say);

// A boot that reports what it finds, and ends.
void reportStoreRoom(const std::filesystem::path& folder, const Say& say);

}  // namespace probebox::faults
