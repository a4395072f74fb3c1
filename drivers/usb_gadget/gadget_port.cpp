#include "drivers/usb_gadget/gadget_port.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <sys/epoll.h>
#include <utility>

#include "drivers/usb_gadget/lane.hpp"
#include "drivers/usb_gadget/linux_aio.hpp"
#include "drivers/usb_gadget/linux_function_fs.hpp"

namespace probebox::usb_gadget {
namespace {

constexpr Lane::Size kDataIn{.transfers = 8, .transfer_bytes = 32 * 1024};
constexpr Lane::Size kDataOut{.transfers = 4, .transfer_bytes = 4 * 1024};
constexpr Lane::Size kControlIn{.transfers = 4, .transfer_bytes = 16 * 1024};
constexpr Lane::Size kControlOut{.transfers = 4, .transfer_bytes = 4 * 1024};
constexpr int kTransfers = 20;
static_assert(kDataIn.transfers + kDataOut.transfers + kControlIn.transfers + kControlOut.transfers == kTransfers);

// Completions show once each (EPOLLET): their count need not be read. What the bus does shows until it is taken.
io::Descriptor watching(const FunctionFs& function, const AioQueue& queue) {
  io::Descriptor all{epoll_create1(EPOLL_CLOEXEC)};
  epoll_event bus{.events = EPOLLIN, .data = {.fd = function.descriptor()}};
  epoll_event completions{.events = EPOLLIN | EPOLLET, .data = {.fd = queue.descriptor()}};
  if (!all || epoll_ctl(all.get(), EPOLL_CTL_ADD, function.descriptor(), &bus) != 0 ||
      epoll_ctl(all.get(), EPOLL_CTL_ADD, queue.descriptor(), &completions) != 0)
    return {};
  return all;
}

}  // namespace

struct GadgetPort::Bus {
  // `clearing`: transfers of an earlier connection, or of none, are on their way back. A connection is offered when
  // they are, so nothing of one host ever reaches the next.
  enum class Stage : std::uint8_t { down, clearing, up };

  Bus(std::unique_ptr<FunctionFs> opened_function, std::unique_ptr<AioQueue> opened_queue, io::Descriptor descriptors)
      : function{std::move(opened_function)},
        queue{std::move(opened_queue)},
        all{std::move(descriptors)},
        data_in{*queue, function->endpoint(0), kDataIn},
        data_out{*queue, function->endpoint(1), kDataOut},
        control_in{*queue, function->endpoint(2), kControlIn},
        control_out{*queue, function->endpoint(3), kControlOut} {}

  ~Bus() {
    cancel();
    queue->drain();
  }

  std::array<Lane*, 4> lanes() { return {&data_in, &data_out, &control_in, &control_out}; }

  void cancel() {
    for (auto* lane : lanes()) lane->cancel();
  }

  void turn();
  void take(BusEvent event);
  void end(bool begin_anew);
  void clear();

  std::unique_ptr<FunctionFs> function;
  std::unique_ptr<AioQueue> queue;
  io::Descriptor all;
  InLane data_in;
  OutLane data_out;
  InLane control_in;
  OutLane control_out;
  Stage stage{Stage::down};
  bool enabled{};
  bool offered{};
  std::uint64_t connection{};  // number of the present one
  PortCounters counters;
};

void GadgetPort::Bus::turn() {
  std::array<epoll_event, 2> ready;
  const int count = epoll_wait(all.get(), ready.data(), ready.size(), 0);
  queue->reap();
  for (int k = 0; k < count; ++k) {
    if (ready[static_cast<std::size_t>(k)].data.fd != function->descriptor()) continue;
    while (const auto event = function->next()) take(*event);
  }
  if (stage == Stage::up) {
    for (auto* lane : lanes()) {
      if (!lane->failed()) continue;
      ++counters.failed_transfers;
      end(false);
      break;
    }
  }
  if (stage == Stage::clearing && queue->inFlight() == 0) clear();
  if (stage == Stage::up) {
    data_in.go();
    control_in.go();
  }
}

void GadgetPort::Bus::take(BusEvent event) {
  switch (event) {
    case BusEvent::enabled:
      return end(true);
    case BusEvent::disabled:
    case BusEvent::unbound:
      return end(false);
    case BusEvent::suspended:
      ++counters.suspensions;
      return;
    case BusEvent::bound:
    case BusEvent::resumed:
      return;
  }
}

void GadgetPort::Bus::end(bool begin_anew) {
  enabled = begin_anew;
  offered = false;
  ++connection;
  stage = Stage::clearing;
  cancel();
}

void GadgetPort::Bus::clear() {
  counters.discarded_bytes += data_in.restart() + data_out.restart() + control_in.restart() + control_out.restart();
  stage = enabled ? Stage::up : Stage::down;
  if (!enabled) return;
  data_out.listen();
  control_out.listen();
  ++counters.connections;
  offered = true;
}

namespace {

// One direction pair of one connection; closed for good when the next begins.
template <class Bus>
class GadgetPipe final : public io::BytePipe {
 public:
  GadgetPipe(std::shared_ptr<Bus> bus, OutLane& from_host, InLane& to_host)
      : bus_{std::move(bus)}, from_host_{from_host}, to_host_{to_host}, connection_{bus_->connection} {}

  io::Transfer read(std::span<std::byte> into) override {
    if (!open()) return {0, io::PipeState::closed};
    return {from_host_.read(into), io::PipeState::open};
  }
  io::Transfer write(std::span<const std::byte> from) override {
    if (!open()) return {0, io::PipeState::closed};
    return {to_host_.write(from), io::PipeState::open};
  }
  int descriptor() const override { return bus_->all.get(); }
  bool watchedForWriting() const override { return false; }
  std::string_view name() const override { return "usb"; }

 private:
  bool open() const { return bus_->connection == connection_; }

  std::shared_ptr<Bus> bus_;
  OutLane& from_host_;
  InLane& to_host_;
  std::uint64_t connection_;
};

}  // namespace

Outcome<PortAddress> parsePort(std::string_view text) {
  PortAddress address;
  if (text.empty()) return address;
  const Error bad{"'usb" + std::string{text} +
                  "' is not a USB port: write usb, or usb:controller=NAME, or usb:mount=DIR,gadget=DIR"};
  if (!text.starts_with(':')) return bad;
  text.remove_prefix(1);
  while (!text.empty()) {
    const auto part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(part.size() + 1, text.size()));
    const auto equals = part.find('=');
    if (equals == std::string_view::npos || equals + 1 == part.size()) return bad;
    const auto key = part.substr(0, equals);
    const std::string value{part.substr(equals + 1)};
    if (key == "mount") {
      address.function_fs = value;
    } else if (key == "gadget") {
      address.gadget = value;
    } else if (key == "controller") {
      address.controller = value;
    } else {
      return bad;
    }
  }
  return address;
}

Outcome<std::unique_ptr<GadgetPort>> GadgetPort::open(const PortAddress& address) {
  TRY(auto function, FunctionFs::open(address.function_fs, linkFunction()));
  TRY(auto queue, AioQueue::open(kTransfers));
  auto all = watching(*function, *queue);
  if (!all) return Error{std::string{"no descriptor for the USB port: "} + std::strerror(errno)};
  TRY(bindGadget(address.gadget, address.controller));
  return std::unique_ptr<GadgetPort>{
      new GadgetPort{std::make_shared<Bus>(std::move(function), std::move(queue), std::move(all))}};
}

GadgetPort::GadgetPort(std::shared_ptr<Bus> bus) : bus_{std::move(bus)} {}

GadgetPort::~GadgetPort() {
  bus_->end(false);
}

int GadgetPort::descriptor() const {
  return bus_->all.get();
}

void GadgetPort::turn() {
  bus_->turn();
}

std::optional<io::Connection> GadgetPort::accept() {
  if (!std::exchange(bus_->offered, false)) return std::nullopt;
  return io::Connection{std::make_unique<GadgetPipe<Bus>>(bus_, bus_->data_out, bus_->data_in),
                        std::make_unique<GadgetPipe<Bus>>(bus_, bus_->control_out, bus_->control_in)};
}

PortCounters GadgetPort::counters() const {
  PortCounters counters = bus_->counters;
  counters.stalled_requests = bus_->function->stalledRequests();
  return counters;
}

}  // namespace probebox::usb_gadget
