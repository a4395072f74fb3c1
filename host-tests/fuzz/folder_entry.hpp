#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

// What both the fuzzer and the ordinary test feed: files of a case folder, each behind a line "=== NAME". Aborts when
// the folder is neither a case that comes back the same after it was written, nor refused with a name and a sentence.
int feedFolder(const std::uint8_t* data, std::size_t size);
