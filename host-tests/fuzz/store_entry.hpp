#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: changes of the file of a store that holds a result in force, one
// that waits, others and a refusal. The first byte says how much of the file is left; then five bytes a change, place,
// bits that are turned over and number of bytes. Aborts when a result that the box would believe says anything that was
// not stored, or when one is lost and nothing tells so.
int feedStore(const std::uint8_t* data, std::size_t size);
