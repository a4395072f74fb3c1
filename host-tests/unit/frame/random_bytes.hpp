#pragma once
#include <cstddef>
#include <cstdint>
#include <rapidcheck.h>
#include <span>
#include <vector>

namespace probebox::frame {

using ByteVector = std::vector<std::byte>;

inline ByteVector bytes(std::initializer_list<int> values) {
  ByteVector all;
  for (const int value : values) all.push_back(static_cast<std::byte>(value));
  return all;
}

// Any length up to `longest`, with many zeros and long runs without one: where COBS has its corners.
inline rc::Gen<ByteVector> anyBytes(std::size_t longest) {
  const auto byte = rc::gen::weightedOneOf<int>(
      {{1, rc::gen::just(0)}, {8, rc::gen::inRange(0, 256)}, {8, rc::gen::inRange(1, 256)}});
  return rc::gen::mapcat(rc::gen::inRange<std::size_t>(0, longest + 1), [byte](std::size_t length) {
    return rc::gen::map(rc::gen::container<std::vector<int>>(length, byte), [](const std::vector<int>& values) {
      ByteVector all;
      for (const int value : values) all.push_back(static_cast<std::byte>(value));
      return all;
    });
  });
}

}  // namespace probebox::frame
