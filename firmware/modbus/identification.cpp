#include "firmware/modbus/identification.hpp"

#include <array>

namespace probebox::modbus {
namespace {

constexpr std::uint8_t kReadIdentification = 14;
constexpr std::uint8_t kOne = 4;                // object alone
constexpr std::uint8_t kBasicAndSingle = 0x81;  // conformity level
constexpr std::uint8_t kIllegalAddress = 2, kIllegalValue = 3;
constexpr std::size_t kMostText = 60;

std::size_t sealed(std::span<std::uint8_t> answer, std::size_t size) {
  const auto crc = crc16(answer.first(size));
  answer[size] = static_cast<std::uint8_t>(crc);
  answer[size + 1] = static_cast<std::uint8_t>(crc >> 8);
  return size + 2;
}

std::size_t refused(const Request& request, std::uint8_t code, std::span<std::uint8_t> answer) {
  answer[0] = request.unit();
  answer[1] = static_cast<std::uint8_t>(request.bytes[1] | 128U);
  answer[2] = code;
  return sealed(answer, 3);
}

}  // namespace

std::size_t identification(const Request& request, std::string_view revision, std::span<std::uint8_t> answer) {
  if (request.size != 7 || request.bytes[2] != kReadIdentification) return 0;
  const std::uint8_t kind = request.bytes[3], first = request.bytes[4];
  const std::array<std::string_view, 3> objects{"probebox", "probe interface box", revision.substr(0, kMostText)};
  if (kind == 0 || kind > kOne) return refused(request, kIllegalValue, answer);
  const bool one = kind == kOne;
  if (one && first >= objects.size()) return refused(request, kIllegalAddress, answer);
  // A stream of objects begins anew where it is asked for one that is not there.
  const std::size_t from = first < objects.size() ? first : 0, to = one ? from + 1 : objects.size();
  std::size_t size = 0;
  for (const std::uint8_t byte : {request.unit(), request.bytes[1], kReadIdentification, kind, kBasicAndSingle,
                                  std::uint8_t{0}, std::uint8_t{0}, static_cast<std::uint8_t>(to - from)})
    answer[size++] = byte;
  for (std::size_t i = from; i < to; ++i) {
    answer[size++] = static_cast<std::uint8_t>(i);
    answer[size++] = static_cast<std::uint8_t>(objects[i].size());
    for (const char c : objects[i]) answer[size++] = static_cast<std::uint8_t>(c);
  }
  return sealed(answer, size);
}

}  // namespace probebox::modbus
