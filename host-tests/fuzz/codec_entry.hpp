#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: these bytes as a block of some channels, which must be refused or
// give values that are coded again and come back the same; and the same bytes as values. Aborts otherwise.
int feedCodec(const std::uint8_t* data, std::size_t size);
