#include "firmware/stream/byte_fifo.hpp"

#include <algorithm>

#include "protocol/frame/bytes.hpp"

namespace probebox::stream {

ByteFifo::ByteFifo(std::size_t bytes, std::size_t items) : storage_(bytes), places_(std::max<std::size_t>(items, 1)) {}

std::span<std::byte> ByteFifo::room(std::size_t size) {
  if (size == 0 || size > storage_.size() || count_ == places_.size()) return {};
  if (count_ == 0) {
    room_at_ = 0;
    return std::span{storage_}.first(size);
  }
  const auto begin = place(0).offset;
  const auto& last = place(count_ - 1);
  const auto end = last.offset + last.size;
  // Items lie between begin and end, or, once they have wrapped, from begin to the back and from the front to end.
  if (last.offset >= begin) {
    if (storage_.size() - end >= size) {
      room_at_ = end;
    } else if (begin >= size) {
      room_at_ = 0;
    } else {
      return {};
    }
  } else if (begin - end >= size) {
    room_at_ = end;
  } else {
    return {};
  }
  return std::span{storage_}.subspan(room_at_, size);
}

void ByteFifo::commit(std::size_t size) {
  places_[(head_ + count_) % places_.size()] = {room_at_, size};
  ++count_;
  bytes_ += size;
}

bool ByteFifo::push(std::span<const std::byte> item) {
  const auto into = room(item.size());
  if (into.empty()) return false;
  frame::copyBytes(item, into.data());
  commit(item.size());
  return true;
}

std::span<const std::byte> ByteFifo::at(std::size_t k) const {
  return std::span{storage_}.subspan(place(k).offset, place(k).size);
}

void ByteFifo::pop() {
  bytes_ -= place(0).size;
  head_ = (head_ + 1) % places_.size();
  --count_;
}

void ByteFifo::clear() {
  head_ = count_ = bytes_ = 0;
}

}  // namespace probebox::stream
