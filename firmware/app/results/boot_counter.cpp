#include "firmware/app/results/boot_counter.hpp"

#include <charconv>
#include <random>

#include "firmware/app/log/log.hpp"
#include "firmware/store/twin_file.hpp"

namespace probebox::app {
namespace {

std::uint16_t byChance() {
  return static_cast<std::uint16_t>(std::random_device{}());
}

}  // namespace

std::uint16_t countBoot(const std::string& path) {
  auto file = store::TwinFile::open(path, 16, std::to_string(byChance()));
  std::uint16_t boots = 0;
  const auto& before = file.content();
  std::from_chars(before.data(), before.data() + before.size(), boots);
  ++boots;
  if (const auto kept = file.write(std::to_string(boots)); !kept) {
    logWarning("The counter of starts cannot be kept: " + kept.error().what);
    return byChance();
  }
  return boots;
}

}  // namespace probebox::app
