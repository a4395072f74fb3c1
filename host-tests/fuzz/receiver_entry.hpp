#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: these bytes as transfers of a probe receiver, cut as the first byte
// says. Aborts when a byte or a sample is not accounted for.
int feedReceiver(const std::uint8_t* data, std::size_t size);
