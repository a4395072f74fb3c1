#pragma once
#include <cstddef>
#include <cstdint>

namespace probebox::vm {

// The least that moves bytes from FunctionFS to libusb: the kernel's asynchronous I/O on one side, asynchronous
// transfers on the other, as many as the box and its hosts have; nothing is copied, checked or understood.
// Returns bytes per second of CLOCK_MONOTONIC. Needs a gadget that is set up and not played by anybody.
double barePump(std::uint64_t bytes, std::size_t transfer_bytes);

}  // namespace probebox::vm
