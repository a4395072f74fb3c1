#pragma once
#include <cstdint>
#include <filesystem>

// What goes wrong with the disk of a box.
namespace probebox::campaign {

// The disk takes no byte while it is full; the memory of /run does.
void setDiskFull(bool full);

// Turns one bit of a file over, as a cut write leaves one copy of a small file. `bit` counts round the file.
void spoil(const std::filesystem::path& file, std::uint64_t bit);

}  // namespace probebox::campaign
