#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace probebox::stream {

// Queue of byte strings, each contiguous. Bounded in bytes and items; allocates in the constructor only.
class ByteFifo {
 public:
  ByteFifo(std::size_t bytes, std::size_t items);

  // Reserves contiguous room for `size` bytes (at least 1), to be filled and then committed with the final size. Empty
  // when there is no room.
  std::span<std::byte> room(std::size_t size);
  void commit(std::size_t size);
  bool push(std::span<const std::byte> item);

  // k = 0 is the oldest.
  std::span<const std::byte> at(std::size_t k) const;
  std::span<const std::byte> front() const { return at(0); }
  void pop();
  void clear();

  bool empty() const { return count_ == 0; }
  std::size_t items() const { return count_; }
  std::size_t bytes() const { return bytes_; }
  std::size_t capacity() const { return storage_.size(); }

 private:
  struct Place {
    std::size_t offset{};
    std::size_t size{};
  };
  const Place& place(std::size_t k) const { return places_[(head_ + k) % places_.size()]; }

  std::vector<std::byte> storage_;
  std::vector<Place> places_;
  std::size_t head_{};
  std::size_t count_{};
  std::size_t bytes_{};
  std::size_t room_at_{};
};

}  // namespace probebox::stream
