#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: these bytes as a file of answers for `probebox report`. Aborts when
// it is refused without a sentence.
int feedAnswers(const std::uint8_t* data, std::size_t size);
