#include "protocol/codec/raw_column.hpp"

#include <algorithm>
#include <concepts>
#include <utility>

#include "protocol/codec/kernels.hpp"

namespace probebox::codec {
namespace {

// Zero where T holds the value.
template <class T>
std::uint64_t misfitOf(std::int64_t value) {
  if constexpr (std::same_as<T, std::uint64_t>) return static_cast<std::uint64_t>(value) >> 63U;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(static_cast<T>(value)) ^ value);
}

template <class T>
std::size_t firstMisfitOf(std::span<const std::int64_t> column) {
  const auto first = std::ranges::find_if(column, [](std::int64_t value) { return misfitOf<T>(value) != 0; });
  return static_cast<std::size_t>(first - column.begin());
}

// All are converted before any is judged: loops without a way out become vector instructions.
template <class T>
std::size_t putColumn(frame::ByteWriter& writer, std::span<const std::int64_t> column) {
  std::byte* const into = writer.take(column.size() * sizeof(T)).data();
  std::uint64_t misfits = 0;
  for (std::size_t k = 0; k < column.size(); ++k) {
    frame::storeLittle(static_cast<T>(column[k]), into + k * sizeof(T));
    misfits |= misfitOf<T>(column[k]);
  }
  return misfits == 0 ? column.size() : firstMisfitOf<T>(column);
}

template <class T>
bool getColumn(frame::ByteReader& reader, std::span<std::int64_t> column) {
  const std::byte* const from = reader.take(column.size() * sizeof(T)).data();
  bool all_fit = true;
  for (std::size_t k = 0; k < column.size(); ++k) {
    const auto read = frame::loadLittle<T>(from + k * sizeof(T));
    column[k] = static_cast<std::int64_t>(read);
    all_fit &= std::in_range<std::int64_t>(read);
  }
  return all_fit;
}

// Calls with the integer type that the format names.
template <class Function>
auto withType(ChannelFormat format, Function&& function) {
  switch (format.bytes) {
    case 1:
      return format.is_signed ? function(std::int8_t{}) : function(std::uint8_t{});
    case 2:
      return format.is_signed ? function(std::int16_t{}) : function(std::uint16_t{});
    case 4:
      return format.is_signed ? function(std::int32_t{}) : function(std::uint32_t{});
    default:
      return format.is_signed ? function(std::int64_t{}) : function(std::uint64_t{});
  }
}

}  // namespace

std::size_t putRaw(frame::ByteWriter& writer, ChannelFormat format, std::span<const std::int64_t> column) {
  return withType(format, [&](auto type) { return putColumn<decltype(type)>(writer, column); });
}

bool getRaw(frame::ByteReader& reader, ChannelFormat format, std::span<std::int64_t> column) {
  return withType(format, [&](auto type) { return getColumn<decltype(type)>(reader, column); });
}

std::size_t firstMisfit(ChannelFormat format, std::span<const std::int64_t> column, const Kernels& kernels) {
  if (format.bytes == 8 && format.is_signed) return column.size();
  const unsigned bits = format.bytes == 8 ? 63 : 8U * format.bytes;
  const std::uint64_t bias = format.is_signed ? std::uint64_t{1} << (bits - 1) : 0;
  if (kernels.beyond(column.data(), column.size(), bias, bits) == 0) return column.size();
  return withType(format, [&](auto type) { return firstMisfitOf<decltype(type)>(column); });
}

}  // namespace probebox::codec
