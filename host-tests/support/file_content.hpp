#pragma once
#include <fstream>
#include <iterator>
#include <string>

namespace probebox::support {

// All bytes of a file; none where it cannot be read.
inline std::string contentOf(const std::string& path) {
  std::ifstream in{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

}  // namespace probebox::support
