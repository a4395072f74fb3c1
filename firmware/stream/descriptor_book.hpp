#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace probebox::stream {

// Keeps the last descriptors of a box by hash: blocks in the history may have been encoded under earlier ones.
class DescriptorBook {
 public:
  // Far more than can change while a block waits.
  static constexpr std::size_t kKept = 32;

  // Adds the payload of DESCRIPTOR, valid from now on. Allocates.
  void add(std::span<const std::byte> encoded);

  // Hash of the newest; 0 before the first.
  std::uint32_t current() const { return known_.empty() ? 0 : known_.back().hash; }
  // Empty when it is unknown or no longer kept.
  std::span<const std::byte> find(std::uint32_t hash) const;

 private:
  struct Known {
    std::uint32_t hash{};
    std::vector<std::byte> encoded;
  };
  std::deque<Known> known_;
};

}  // namespace probebox::stream
