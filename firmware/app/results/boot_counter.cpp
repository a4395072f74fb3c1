#include "firmware/app/results/boot_counter.hpp"

#include <charconv>
#include <random>

#include "firmware/store/twin_file.hpp"

namespace probebox::app {
namespace {

std::uint16_t byChance() {
  return static_cast<std::uint16_t>(std::random_device{}());
}

}  // namespace

Boots countBoot(const std::string& path, store::Before before) {
  auto file = store::TwinFile::open(path, 16, std::to_string(byChance()), before);
  std::uint16_t boots = 0;
  const auto& last = file.content();
  std::from_chars(last.data(), last.data() + last.size(), boots);
  ++boots;
  if (const auto kept = file.write(std::to_string(boots)); !kept) {
    return {byChance(), "The counter of starts cannot be kept: " + kept.error().what};
  }
  return {boots, file.notice()};
}

}  // namespace probebox::app
