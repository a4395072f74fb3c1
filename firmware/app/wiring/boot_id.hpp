#pragma once
#include <array>
#include <cstddef>
#include <fstream>

#include "protocol/messages/types.hpp"

namespace probebox::app {

// A new number by which hosts know one start of the daemon from another.
inline messages::BootId newBootId() {
  messages::BootId id{};
  std::ifstream random{"/dev/urandom", std::ios::binary};
  std::array<char, sizeof id> bytes{};
  random.read(bytes.data(), bytes.size());
  for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::byte>(bytes[i]);
  return id;
}

}  // namespace probebox::app
