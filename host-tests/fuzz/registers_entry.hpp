#pragma once
#include <cstddef>
#include <cstdint>

// What both the fuzzer and the ordinary test feed: the first byte chooses a serial line or a connection, the second how
// the others are cut; they come to the register server's handler as a master's. Aborts when a byte is not accounted
// for, when an answer is not what Modbus allows to its request, or when a refused write has changed or told anything.
int feedRegisters(const std::uint8_t* data, std::size_t size);
