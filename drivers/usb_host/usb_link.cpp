#include "drivers/usb_host/usb_link.hpp"

#include <memory>
#include <string>
#include <utility>

#include "drivers/usb_host/bulk_in.hpp"
#include "drivers/usb_host/bulk_out.hpp"
#include "drivers/usb_host/claimed_interface.hpp"

namespace probebox::usb_host {
namespace {

// Requests and answers are few and small.
constexpr TransferRing::Size kControlIn{.transfers = 8, .transfer_bytes = 16 * 1024};
constexpr TransferRing::Size kControlOut{.transfers = 4, .transfer_bytes = 16 * 1024};

// Lets the box know at once that its host leaves, after the transfers have come back.
struct Farewell {
  ClaimedInterface& interface;
  bool due{};

  ~Farewell() {
    if (due) (void)interface.reset();
  }
};

// Interface shared by both lanes; the last lane to be destroyed closes it.
struct Link {
  explicit Link(std::unique_ptr<ClaimedInterface> claimed)
      : device{std::move(claimed)},
        farewell{*device, false},
        data_in{*device, endpoint(0)},
        data_out{*device, endpoint(1)},
        control_in{*device, endpoint(2), kControlIn},
        control_out{*device, endpoint(3), kControlOut} {}

  ~Link() {
    device->context().handle();
    farewell.due = data_in.state() == EndpointState::open && data_out.state() == EndpointState::open;
  }

  const Endpoint& endpoint(std::size_t index) const { return device->device().endpoints[index]; }

  std::unique_ptr<ClaimedInterface> device;
  Farewell farewell;
  BulkIn data_in;
  BulkOut data_out;
  BulkIn control_in;
  BulkOut control_out;
};

class Lane final : public io::BytePipe {
 public:
  Lane(std::shared_ptr<Link> link, BulkIn& in, BulkOut& out)
      : link_{std::move(link)}, in_{in}, out_{out}, name_{"usb:" + link_->device->device().name()} {}

  io::Transfer read(std::span<std::byte> into) override {
    // Right after front() found nothing there is nothing: what comes now shows on the descriptor.
    const auto moved = std::exchange(empty_, false) ? 0 : in_.read(into);
    const bool over = in_.over() || (in_.front().empty() && out_.state() != EndpointState::open);
    return {moved, over ? io::PipeState::closed : io::PipeState::open};
  }
  std::span<const std::byte> front() override {
    const auto there = in_.next();
    empty_ = there.empty();
    return there;
  }
  void consume(std::size_t bytes) override { in_.consume(bytes); }
  io::Transfer write(std::span<const std::byte> from) override {
    const auto moved = out_.write(from);
    return {moved, out_.state() == EndpointState::open ? io::PipeState::open : io::PipeState::closed};
  }
  int descriptor() const override { return link_->device->context().descriptor(); }
  bool watchedForWriting() const override { return false; }
  std::string_view name() const override { return name_; }

 private:
  std::shared_ptr<Link> link_;
  BulkIn& in_;
  BulkOut& out_;
  std::string name_;
  bool empty_{};
};

// data IN, data OUT, control IN, control OUT.
bool hasTheFourEndpoints(const Device& device) {
  const auto& all = device.endpoints;
  return all.size() == 4 && all[0].in && !all[1].in && all[2].in && !all[3].in;
}

}  // namespace

Outcome<io::Connection, OpenError> openUsbLink(std::string_view name) {
  TRY(auto claimed, ClaimedInterface::open(usb::kLink, name));
  const auto& device = claimed->device();
  if (!hasTheFourEndpoints(device)) {
    return OpenError{OpenError::Kind::failed,
                     "usb:" + device.name() + ": not the endpoints of a probebox; its firmware version may not match"};
  }
  const auto link = std::make_shared<Link>(std::move(claimed));
  return io::Connection{std::make_unique<Lane>(link, link->data_in, link->data_out),
                        std::make_unique<Lane>(link, link->control_in, link->control_out)};
}

}  // namespace probebox::usb_host
