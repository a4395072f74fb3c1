#pragma once
#include <span>

#include "protocol/codec/kernel_table.hpp"

namespace probebox::codec {

struct NamedKernels {
  const char* name{};
  const Kernels* kernels{};
};

// Returns the kernels that this processor supports: plain C++ first, the fastest last.
std::span<const NamedKernels> allKernels();
const Kernels& kernels();

}  // namespace probebox::codec
