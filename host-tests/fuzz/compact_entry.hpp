#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: short frames in pieces, of which each may refer to what came before.
// Aborts when one is restored to what no box sends, or twice to something else.
int feedCompact(const std::uint8_t* data, std::size_t size);
