#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: these bytes as the first of a connection, in pieces as the
// first byte has it. Aborts when the gate takes more than it has room for, or lets anything in but HELLO.
int feedGate(const std::uint8_t* data, std::size_t size);
