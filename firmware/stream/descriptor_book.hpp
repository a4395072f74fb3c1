#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace probebox::stream {

// The last descriptors of a box, by their hashes: blocks of the history were encoded under earlier ones.
class DescriptorBook {
 public:
  // Far more than change while a block waits anywhere.
  static constexpr std::size_t kKept = 32;

  // The payload of DESCRIPTOR, in force from here on. Allocates.
  void add(std::span<const std::byte> encoded);

  // Hash of the newest; 0 before there was one.
  std::uint32_t current() const { return known_.empty() ? 0 : known_.back().hash; }
  // Empty when it is not known, or no longer.
  std::span<const std::byte> find(std::uint32_t hash) const;

 private:
  struct Known {
    std::uint32_t hash{};
    std::vector<std::byte> encoded;
  };
  std::deque<Known> known_;
};

}  // namespace probebox::stream
