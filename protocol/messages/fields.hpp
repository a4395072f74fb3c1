#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "protocol/frame/bytes.hpp"
#include "protocol/units/outcome.hpp"

// Encodes, decodes and describes messages from one field list. A structure names its fields once, in
//   static constexpr void fields(auto& self, auto&& field) { field("name", self.name, "what it is, with unit"); ... }
// (behind that may stand conditions of protocol/state/shown_when.hpp and a kind of kind_of_value.hpp) and its encoder,
// decoder, size, row in MESSAGES.md and JSON follow from that list.
//
// Bytes: scalars little endian; bool one byte; text and bytes with a u16 length; lists with a u16 count; arrays bare; a
// structure inside a structure with a u16 size; a variant as u8 alternative, then that structure.
// Growth: a later minor version may add fields at the end of any structure. A reader skips fields it does not know;
// a field that an older writer did not send keeps its default. A field cut off in its middle is an error. A list that
// another one includes (CoreStatus in the answer about status) is closed: what is added stands at the end of that
// other.
namespace probebox::messages {

enum class WireError : std::uint8_t { truncated = 0, no_room = 1, too_long = 2, unknown_alternative = 3 };
std::string_view nameOf(WireError error);

namespace detail {
struct AnyField {
  void operator()(auto&&...) const {}
};
template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t N>
inline constexpr bool kIsArray<std::array<T, N>> = true;
template <class T>
inline constexpr bool kIsVector = false;
template <class T>
inline constexpr bool kIsVector<std::vector<T>> = true;
template <class T>
inline constexpr bool kIsVariant = false;
template <class... Ts>
inline constexpr bool kIsVariant<std::variant<Ts...>> = true;
}  // namespace detail

template <class T>
concept Structure = requires(T& value) {
  T::fields(value, detail::AnyField{});
};

template <class T>
concept Text = std::same_as<T, std::string> || std::same_as<T, std::string_view>;

// Holds raw bytes. Span and string_view do not own them: after decode they point into the source.
template <class T>
concept Bytes = std::same_as<T, std::vector<std::byte>> || std::same_as<T, std::span<const std::byte>>;

namespace detail {

inline constexpr std::size_t kLongest = 0xFFFF;

template <class T>
void encodeValue(frame::ByteWriter& writer, const T& value);

template <Structure T>
void encodeFields(frame::ByteWriter& writer, const T& value) {
  T::fields(value, [&](auto, const auto& member, auto&&...) { encodeValue(writer, member); });
}

inline void encodeBytes(frame::ByteWriter& writer, std::span<const std::byte> bytes) {
  if (bytes.size() > kLongest) return writer.refuse();
  writer.put(static_cast<std::uint16_t>(bytes.size()));
  writer.put(bytes);
}

template <Structure T>
void encodeNested(frame::ByteWriter& writer, const T& value) {
  const auto at = writer.size();
  writer.put(std::uint16_t{0});
  encodeFields(writer, value);
  const auto size = writer.size() - at - sizeof(std::uint16_t);
  if (size > kLongest) return writer.refuse();
  writer.patch(at, static_cast<std::uint16_t>(size));
}

template <class T>
void encodeValue(frame::ByteWriter& writer, const T& value) {
  if constexpr (frame::Scalar<T>) {
    writer.put(value);
  } else if constexpr (Text<T>) {
    encodeBytes(writer, std::as_bytes(std::span{value}));
  } else if constexpr (Bytes<T>) {
    encodeBytes(writer, value);
  } else if constexpr (kIsArray<T>) {
    for (const auto& element : value) encodeValue(writer, element);
  } else if constexpr (kIsVector<T>) {
    if (value.size() > kLongest) return writer.refuse();
    writer.put(static_cast<std::uint16_t>(value.size()));
    for (const auto& element : value) encodeValue(writer, element);
  } else {
    static_assert(Structure<T>, "a field is a scalar, text, bytes, an array, a vector or a structure with fields()");
    encodeNested(writer, value);
  }
}

template <class T>
void decodeValue(frame::ByteReader& reader, T& value);

template <Structure T>
void decodeFields(frame::ByteReader& reader, T& value) {
  T::fields(value, [&](auto, auto& member, auto&&...) {
    if (!reader.failed() && reader.remaining() > 0) decodeValue(reader, member);
  });
}

template <Structure T>
void decodeNested(frame::ByteReader& reader, T& value) {
  frame::ByteReader inner{reader.take(reader.get<std::uint16_t>())};
  decodeFields(inner, value);
  if (inner.failed()) reader.fail();
}

template <class T>
void decodeValue(frame::ByteReader& reader, T& value) {
  if constexpr (frame::Scalar<T>) {
    value = reader.get<T>();
  } else if constexpr (Text<T>) {
    const auto bytes = reader.take(reader.get<std::uint16_t>());
    value = T{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  } else if constexpr (Bytes<T>) {
    const auto bytes = reader.take(reader.get<std::uint16_t>());
    value = T{bytes.begin(), bytes.end()};
  } else if constexpr (kIsArray<T>) {
    for (auto& element : value) decodeValue(reader, element);
  } else if constexpr (kIsVector<T>) {
    value.clear();
    // Appends one by one: a false count runs out of bytes before it allocates memory.
    for (std::size_t left = reader.get<std::uint16_t>(); left > 0 && !reader.failed(); --left) {
      if (reader.remaining() == 0) return reader.fail();
      decodeValue(reader, value.emplace_back());
    }
  } else {
    decodeNested(reader, value);
  }
}

}  // namespace detail

// Returns the number of bytes that encode() needs.
template <Structure T>
std::size_t encodedSize(const T& value) {
  frame::ByteWriter writer{{}};
  detail::encodeFields(writer, value);
  return writer.size();
}

// Encodes into the caller's bytes without allocating; returns the number of bytes. Fails with no_room, or with too_long
// for a text or list of more than 65535 elements.
template <Structure T>
Outcome<std::size_t, WireError> encode(const T& value, std::span<std::byte> into) {
  frame::ByteWriter writer{into};
  detail::encodeFields(writer, value);
  if (writer.refused()) return WireError::too_long;
  if (!writer.complete()) return WireError::no_room;
  return writer.size();
}

// Encodes into a new vector, for callers that may allocate. Returns an empty one where encode() fails with too_long.
template <Structure T>
std::vector<std::byte> encoded(const T& value) {
  std::vector<std::byte> bytes(encodedSize(value));
  if (!encode(value, bytes)) bytes.clear();
  return bytes;
}

// Decodes a structure. Fails with truncated when a field is cut off. Skips bytes after the last known field.
template <Structure T>
Outcome<T, WireError> decode(std::span<const std::byte> bytes) {
  frame::ByteReader reader{bytes};
  T value{};
  detail::decodeFields(reader, value);
  if (reader.failed()) return WireError::truncated;
  return value;
}

// A variant of structures, such as Event: u8 alternative, then the structure.
template <class... Ts>
Outcome<std::size_t, WireError> encode(const std::variant<Ts...>& value, std::span<std::byte> into) {
  frame::ByteWriter writer{into};
  writer.put(static_cast<std::uint8_t>(value.index()));
  std::visit([&](const auto& structure) { detail::encodeFields(writer, structure); }, value);
  if (writer.refused()) return WireError::too_long;
  if (!writer.complete()) return WireError::no_room;
  return writer.size();
}

template <class Variant>
requires detail::kIsVariant<Variant> Outcome<Variant, WireError> decode(std::span<const std::byte> bytes) {
  frame::ByteReader reader{bytes};
  const std::size_t index = reader.get<std::uint8_t>();
  if (reader.failed()) return WireError::truncated;
  Variant value;
  const bool known = [&]<std::size_t... I>(std::index_sequence<I...>) {
    return ((I == index && (detail::decodeFields(reader, value.template emplace<I>()), true)) || ...);
  }
  (std::make_index_sequence<std::variant_size_v<Variant>>{});
  if (!known) return WireError::unknown_alternative;
  if (reader.failed()) return WireError::truncated;
  return value;
}

}  // namespace probebox::messages
