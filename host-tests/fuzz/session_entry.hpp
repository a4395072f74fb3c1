#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: a session that hears these bytes, with samples, time and a slow wire
// in between; and what it sends, read by a host. Aborts when the ledger does not balance or the reader loses count.
int feedSession(const std::uint8_t* data, std::size_t size);
