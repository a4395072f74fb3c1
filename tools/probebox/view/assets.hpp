#pragma once
#include <span>
#include <string_view>

namespace probebox::view {

// A file of the page, as npm has bundled it.
struct Asset {
  const char* path;
  const char* type;
  std::string_view content;
};
std::span<const Asset> assets();

}  // namespace probebox::view
