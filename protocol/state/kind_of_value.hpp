#pragma once
#include <cstddef>
#include <string_view>

#include "protocol/units/correction_sources.hpp"

// Kinds of values in a fields() list, for who follows them over time (tools/fleet/metrics). A number without a kind is
// a reading of now. Bytes, register and JSON do not depend on the kind.
namespace probebox::published {

// Rises with each event, from 0 at the start of the box.
struct Counter {};
// Names something, such as a result or a tool: no quantity.
struct Identifier {};
// A text that is empty while all is well.
struct Complaint {};
// What the elements of an array belong to.
struct Each {
  std::string_view label;
  std::string_view (*name)(std::size_t element){};
};

inline constexpr std::string_view linearAxis(std::size_t k) {
  return std::string_view{"XYZ"}.substr(k % 3, 1);
}

inline constexpr Each kEachXyz{"axis", linearAxis};
inline constexpr Each kEachAbc{"axis", [](std::size_t k) { return std::string_view{"ABC"}.substr(k % 3, 1); }};
inline constexpr Each kEachChannel{"channel", [](std::size_t k) { return std::string_view{"abc"}.substr(k % 3, 1); }};
// Of an array inside of one that has the label axis.
inline constexpr Each kAlongXyz{"along", linearAxis};
inline constexpr Each kEachSource{"source", [](std::size_t k) { return kSources[k].name; }};

}  // namespace probebox::published
