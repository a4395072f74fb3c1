#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: these bytes as a recording. Aborts when a block has not the columns
// of its descriptor, when bytes are not accounted for, or when a recording that cannot be read does not say why.
int feedRecording(const std::uint8_t* data, std::size_t size);
