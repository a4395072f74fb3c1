#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/rtu_requests.hpp"

namespace probebox::modbus {

inline constexpr std::size_t kMaxTcpFrameBytes = 260;

// One received request of a master on the network.
struct TcpRequest {
  std::uint16_t transaction{};  // returned in the answer
  std::uint8_t unit{};          // returned in the answer
  Request request;              // as it is on a serial line, with CRC
};

// Finds requests in the bytes of a TCP connection by the length in their header (MODBUS Messaging on TCP/IP
// Implementation Guide 1.0b, section 3.1.3). Bytes that are no such header, as those of a browser, or no function of a
// request end the search for good: the start of the next request cannot be found. Allocates nothing.
class TcpRequests {
 public:
  // Takes as many bytes as fit; offer the rest after next() has returned nothing.
  std::size_t push(std::span<const std::byte> bytes);

  std::optional<TcpRequest> next();

  // Bytes that are no request yet, and never will be one if the connection ends now.
  std::size_t unfinished() const { return size_; }

  // True when the received bytes are not Modbus over TCP: close the connection.
  bool broken() const { return broken_; }

 private:
  std::array<std::uint8_t, kMaxTcpFrameBytes> buffer_{};
  std::size_t size_{};
  bool broken_{};
};

// Writes the answer to a request, of which `serial` is the form on a serial line, into `frame`, and returns its size.
std::size_t tcpAnswer(const TcpRequest& to, std::span<const std::uint8_t> serial,
                      std::span<std::uint8_t, kMaxTcpFrameBytes> frame);

}  // namespace probebox::modbus
