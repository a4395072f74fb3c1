#include "protocol/frame/frame.hpp"

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::frame {

std::size_t encodeBare(Header header, std::span<const std::byte> payload, std::span<std::byte> into) {
  const auto size = bareSize(payload.size());
  if (payload.size() > 0xFFFF || size > into.size()) return 0;
  header.payload_length = static_cast<std::uint16_t>(payload.size());
  ByteWriter writer{into};
  Header::fields(header, [&](auto, const auto& value, auto) { writer.put(value); });
  writer.put(payload);
  writer.put(crc32c(into.first(writer.size())));
  return writer.size();
}

std::size_t encodeDelimited(Header header, std::span<const std::byte> payload, std::span<std::byte> scratch,
                            std::span<std::byte> into) {
  const auto bare = encodeBare(header, payload, scratch);
  if (bare == 0 || into.size() < cobsMaxSize(bare) + 1) return 0;
  const auto coded = cobsEncode(scratch.first(bare), into);
  into[coded] = kDelimiter;
  return coded + 1;
}

Header headerOf(std::span<const std::byte> bytes) {
  Header header;
  ByteReader reader{bytes};
  Header::fields(header, [&](auto, auto& value, auto) { value = reader.get<std::decay_t<decltype(value)>>(); });
  return header;
}

Outcome<Frame, FrameFault> decodeBare(std::span<const std::byte> bytes) {
  if (bytes.size() < kOverhead) return FrameFault::bad_length;
  const Header header = headerOf(bytes);
  if (bytes.size() != bareSize(header.payload_length)) return FrameFault::bad_length;
  ByteReader crc{bytes.last(kCrcSize)};
  if (crc.get<std::uint32_t>() != crc32c(bytes.first(bytes.size() - kCrcSize))) return FrameFault::bad_crc;
  return Frame{header, bytes.subspan(kHeaderSize, header.payload_length)};
}

}  // namespace probebox::frame
