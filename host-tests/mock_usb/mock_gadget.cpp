#include "host-tests/mock_usb/mock_gadget.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace probebox::usb {
namespace {

// What the firmware may have waiting for the host, as the queue of a real endpoint is bounded.
constexpr std::size_t kMostWaiting = 64 * 1024;

class GadgetLane final : public io::BytePipe {
 public:
  GadgetLane(MockBus& bus, std::string path, std::size_t session, std::uint8_t in, std::uint8_t out)
      : bus_{bus}, path_{std::move(path)}, session_{session}, in_{in}, out_{out} {}

  io::Transfer read(std::span<std::byte> into) override {
    if (over()) return {0, io::PipeState::closed};
    if (unread_.empty()) unread_ = bus_.received(path_, out_);
    const auto bytes = std::min(into.size(), unread_.size());
    const auto end = unread_.begin() + static_cast<std::ptrdiff_t>(bytes);
    std::copy(unread_.begin(), end, into.begin());
    unread_.erase(unread_.begin(), end);
    return {bytes};
  }
  io::Transfer write(std::span<const std::byte> from) override {
    if (over()) return {0, io::PipeState::closed};
    if (bus_.waiting(path_, in_) > kMostWaiting) return {0};
    bus_.send(path_, in_, from);
    // A transfer of whole packets is ended by an empty one.
    if (from.size() % MockBus::kPacketBytes == 0) bus_.send(path_, in_, {});
    return {from.size()};
  }
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "gadget"; }

 private:
  bool over() const { return bus_.session(path_) != session_; }

  MockBus& bus_;
  std::string path_;
  std::size_t session_;
  std::uint8_t in_;
  std::uint8_t out_;
  std::vector<std::byte> unread_;
};

}  // namespace

io::Connection MockGadget::accept() {
  const auto session = bus_.session(device_.path);
  if (session == std::exchange(session_, session) || session == 0 || !bus_.claimed(device_.path)) return {};
  return {std::make_unique<GadgetLane>(bus_, device_.path, session, MockBus::kDataIn, MockBus::kDataOut),
          std::make_unique<GadgetLane>(bus_, device_.path, session, MockBus::kControlIn, MockBus::kControlOut)};
}

}  // namespace probebox::usb
