#include "registers_entry.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <variant>
#include <vector>

#include "firmware/app/cnc/register_handler.hpp"
#include "firmware/modbus/tcp_requests.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using app::RegisterHandler;
using fuzz::require;
using modbus::Request;

constexpr std::uint8_t kUnit = 1;
constexpr std::size_t kCrc = 2;

// A handler that takes what it is told, and notes it.
class Box {
 public:
  void ask(const Request& request) {
    const auto told_before = told_;
    const auto order_before = order_;
    const auto [kind, frame] = handler_.answer(request);
    require(kind != RegisterHandler::Answer::Kind::failed);
    const bool refused = kind == RegisterHandler::Answer::Kind::refused;
    if (refused) require(told_ == told_before && order_ == order_before);
    if (request.unit() == 0) return require(frame.empty());
    look(request, frame, refused);
  }

 private:
  void look(const Request& request, std::span<const std::uint8_t> frame, bool refused) {
    require(frame.size() >= 3 + kCrc && frame.size() <= modbus::kMaxFrameBytes);
    const auto crc = modbus::crc16(frame.first(frame.size() - kCrc));
    require(crc == (frame[frame.size() - 2] | frame[frame.size() - 1] << 8));
    require(frame[0] == request.unit());
    if (refused || frame[1] != request.bytes[1]) {
      require(frame[1] == (request.bytes[1] | 128U) && frame.size() == 3 + kCrc && frame[2] >= 1 && frame[2] <= 4);
      return;
    }
    if (request.function() == modbus::Function::read_holding || request.function() == modbus::Function::read_input)
      require(frame[2] == 2 * request.word(4) && frame.size() == std::size_t{3} + frame[2] + kCrc);
  }
  bool take(std::span<const Event> said) {
    for (const auto& event : said) {
      if (const auto* marker = std::get_if<Marker>(&event)) require(std::isfinite(marker->nominal_speed_mm_s));
    }
    // Now and then the box does not want it.
    if (++offers_ % 5 == 0) return false;
    told_ += said.size();
    return true;
  }

  std::size_t told_{}, offers_{};
  modbus::WordOrder order_{};
  RegisterHandler handler_{kUnit,
                           "1.0",
                           {.snapshot = [] { return published::Snapshot{}; },
                            .take = [this](std::span<const Event> said) { return take(said); },
                            .kept =
                                [this] {
                                  return RegisterHandler::Kept{order_, false};
                                },
                            .keep =
                                [this](modbus::WordOrder order) {
                                  order_ = order;
                                  return true;
                                },
                            .controller_request = [this](const modbus::ControllerRequest&) { ++told_; }}};
};

void serial(std::span<const std::byte> bytes, std::size_t piece, Box& box) {
  modbus::RtuRequests requests;
  std::size_t requested = 0;
  for (auto rest = bytes; !rest.empty();) {
    rest = rest.subspan(requests.push(rest.first(std::min(piece, rest.size()))));
    while (const auto request = requests.next()) {
      requested += request->size;
      if (request->unit() == kUnit || request->unit() == 0) box.ask(*request);
    }
  }
  requests.silence();
  require(!requests.pending());
  // Answers of other units are neither: they are known, and passed over.
  require(requested + requests.skippedBytes() <= bytes.size());
}

void network(std::span<const std::byte> bytes, std::size_t piece, Box& box) {
  modbus::TcpRequests requests;
  for (auto rest = bytes; !rest.empty() && !requests.broken();) {
    rest = rest.subspan(requests.push(rest.first(std::min(piece, rest.size()))));
    while (auto asked = requests.next()) {
      require(asked->request.unit() == asked->unit && asked->request.size >= 2 + kCrc);
      asked->request.bytes[0] = kUnit;
      box.ask(asked->request);
    }
  }
}

}  // namespace

int feedRegisters(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 2) return 0;
  const auto bytes = std::as_bytes(std::span{data + 2, size - 2});
  const std::size_t piece = 1 + data[1];
  Box box;
  (data[0] % 2 == 0 ? serial : network)(bytes, piece, box);
  return 0;
}
