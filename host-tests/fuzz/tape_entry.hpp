#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: bytes of a control on a line of text, cut as the second one says;
// the first says whether it has flow control and seven bits. Aborts when what is understood is no number, or a refusal
// has no name or cannot be printed.
int feedTape(const std::uint8_t* data, std::size_t size);
