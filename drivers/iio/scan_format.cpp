#include "drivers/iio/scan_format.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>

namespace probebox::iio {
namespace {

// The number at the front of `text`, which is consumed.
std::optional<unsigned> takeNumber(std::string_view& text) {
  unsigned value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

std::optional<ScanFormat> parsed(std::string_view text) {
  ScanFormat format;
  format.big_endian = text.starts_with("be:");
  if (!format.big_endian && !text.starts_with("le:")) return std::nullopt;
  text.remove_prefix(3);
  format.is_signed = take(text, "s");
  if (!format.is_signed && !take(text, "u")) return std::nullopt;
  const auto real = takeNumber(text);
  if (!real || !take(text, "/")) return std::nullopt;
  const auto storage = takeNumber(text);
  if (!storage || !take(text, ">>")) return std::nullopt;
  const auto shift = takeNumber(text);
  if (!shift || !text.empty()) return std::nullopt;
  format.real_bits = *real;
  format.storage_bits = *storage;
  format.shift = *shift;
  const bool has_width = *storage == 8 || *storage == 16 || *storage == 32 || *storage == 64;
  if (!has_width || *real == 0 || *real > 64 || *shift > 63 || *real + *shift > *storage) return std::nullopt;
  return format;
}

std::uint64_t mask(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

// The place of the byte with weight 256^i.
std::size_t placeOf(const ScanFormat& format, std::size_t i) {
  return format.big_endian ? format.bytes() - 1 - i : i;
}

}  // namespace

std::int64_t ScanFormat::least() const {
  return is_signed ? -static_cast<std::int64_t>(mask(real_bits - 1)) - 1 : 0;
}

std::int64_t ScanFormat::greatest() const {
  // An unsigned value of 64 bits would not fit; no converter has one.
  return static_cast<std::int64_t>(mask(std::min(real_bits - (is_signed ? 1 : 0), 63U)));
}

Outcome<ScanFormat> parseScanFormat(std::string_view text) {
  if (const auto format = parsed(text)) return *format;
  return Error{"the format \"" + std::string{text} +
               "\" of its buffer is not that of a single number, such as \"le:s16/16>>0\"; choose another channel"};
}

std::int64_t readValue(const ScanFormat& format, std::span<const std::byte> bytes) {
  std::uint64_t stored = 0;
  for (std::size_t i = 0; i < format.bytes(); ++i)
    stored |= std::to_integer<std::uint64_t>(bytes[placeOf(format, i)]) << (8 * i);
  std::uint64_t value = (stored >> format.shift) & mask(format.real_bits);
  const bool negative = format.is_signed && (value >> (format.real_bits - 1) & 1U) != 0;
  if (negative) value |= ~mask(format.real_bits);
  return static_cast<std::int64_t>(value);
}

void writeValue(const ScanFormat& format, std::int64_t value, std::span<std::byte> bytes) {
  const auto clipped = std::clamp(value, format.least(), format.greatest());
  const std::uint64_t stored = (static_cast<std::uint64_t>(clipped) & mask(format.real_bits)) << format.shift;
  for (std::size_t i = 0; i < format.bytes(); ++i)
    bytes[placeOf(format, i)] = static_cast<std::byte>(stored >> (8 * i) & 0xFFU);
}

FrameLayout layOut(std::span<const ScanFormat> formats) {
  FrameLayout layout;
  std::size_t largest = 1;
  const auto aligned = [](std::size_t at, std::size_t size) { return (at + size - 1) / size * size; };
  for (const auto& format : formats) {
    layout.offsets.push_back(aligned(layout.bytes, format.bytes()));
    layout.bytes = layout.offsets.back() + format.bytes();
    largest = std::max(largest, format.bytes());
  }
  layout.bytes = aligned(layout.bytes, largest);
  return layout;
}

}  // namespace probebox::iio
