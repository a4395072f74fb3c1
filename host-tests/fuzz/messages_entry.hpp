#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: the first byte chooses a message, a request, an answer or an event;
// the others are its bytes. Aborts when what was understood does not code to bytes that are understood alike.
int feedMessages(const std::uint8_t* data, std::size_t size);

// How many kinds the first byte chooses from.
std::size_t kindsOfMessages();
