#include "drivers/usb_host/transfer_ring.hpp"

#include <ctime>
#include <libusb.h>
#include <utility>

namespace probebox::usb_host {
namespace {

// A cancelled transfer comes back within a microframe; a controller that has died must not hold up the program for
// ever.
constexpr int kMostRounds = 50;
constexpr int kRoundMs = 20;

MonoTime monotonicNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

}  // namespace

// The shape that libusb calls.
struct TransferCallback {
  static void LIBUSB_CALL cameBack(libusb_transfer* transfer) {
    auto& slot = *static_cast<TransferSlot*>(transfer->user_data);
    if (slot.ring != nullptr) slot.ring->cameBack(slot);
  }
};

std::string_view nameOf(EndpointState state) {
  switch (state) {
    case EndpointState::stalled:
      return "stalled";
    case EndpointState::failed:
      return "failed";
    case EndpointState::gone:
      return "unplugged";
    default:
      return "open";
  }
}

void TransferSlot::Free::operator()(libusb_transfer* transfer) const {
  libusb_free_transfer(transfer);
}

TransferRing::TransferRing(ClaimedInterface& interface, const Endpoint& endpoint, Size size,
                           std::function<void()> returned)
    : interface_{interface}, in_{endpoint.in}, slots_(size.transfers), returned_{std::move(returned)} {
  for (auto& slot : slots_) {
    slot.ring = this;
    slot.buffer.resize(size.transfer_bytes);
    slot.transfer.reset(libusb_alloc_transfer(0));
    libusb_fill_bulk_transfer(slot.transfer.get(), interface.handle(), endpoint.address,
                              reinterpret_cast<unsigned char*>(slot.buffer.data()), 0, TransferCallback::cameBack,
                              &slot, 0);
    // A transfer of whole packets would not end at the device without an empty one.
    if (!in_) slot.transfer->flags = LIBUSB_TRANSFER_ADD_ZERO_PACKET;
  }
}

TransferRing::~TransferRing() {
  returned_ = nullptr;
  end(EndpointState::gone);
  bringBack();
}

void TransferRing::bringBack() {
  for (auto& slot : slots_) {
    if (slot.stage == TransferSlot::Stage::in_flight) libusb_cancel_transfer(slot.transfer.get());
  }
  for (int round = 0; in_flight_ > 0 && round < kMostRounds; ++round) interface_.context().handleWithin(kRoundMs);
  if (in_flight_ == 0) return;
  for (auto& slot : slots_) slot.ring = nullptr;
  interface_.keepForEver(std::make_shared<std::vector<TransferSlot>>(std::move(slots_)));
}

void TransferRing::submit(TransferSlot& slot, std::size_t bytes) {
  if (state_ != EndpointState::open) return;
  slot.transfer->length = static_cast<int>(bytes);
  switch (libusb_submit_transfer(slot.transfer.get())) {
    case LIBUSB_SUCCESS:
      slot.stage = TransferSlot::Stage::in_flight;
      ++in_flight_;
      return;
    case LIBUSB_ERROR_NO_DEVICE:
      return end(EndpointState::gone);
    case LIBUSB_ERROR_PIPE:
      return end(EndpointState::stalled);
    default:
      return end(EndpointState::failed);
  }
}

void TransferRing::cameBack(TransferSlot& slot) {
  slot.came_back = monotonicNow();
  slot.stage = TransferSlot::Stage::done;
  --in_flight_;
  judge(*slot.transfer);
  slot.moved = static_cast<std::size_t>(slot.transfer->actual_length);
  counters_.bytes += slot.moved;
  if (returned_) returned_();
}

void TransferRing::judge(const libusb_transfer& transfer) {
  ++counters_.transfers;
  switch (transfer.status) {
    case LIBUSB_TRANSFER_COMPLETED:
      errors_in_a_row_ = 0;
      return;
    case LIBUSB_TRANSFER_CANCELLED:
      return;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return end(EndpointState::gone);
    case LIBUSB_TRANSFER_STALL:
      ++counters_.stalls;
      return end(EndpointState::stalled);
    case LIBUSB_TRANSFER_OVERFLOW:
      ++counters_.overflows;
      break;
    default:
      ++counters_.errors;
  }
  // Data for the device may not be lost; data from it are checked by their reader.
  if (!in_ || ++errors_in_a_row_ > 2 * slots_.size()) end(EndpointState::failed);
}

void TransferRing::end(EndpointState state) {
  if (state_ == EndpointState::open) state_ = state;
}

}  // namespace probebox::usb_host
