#include "drivers/usb_gadget/linux_aio.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <sys/eventfd.h>
#include <unistd.h>

namespace probebox::usb_gadget {
namespace {

constexpr long kAtOnce = 32;

}  // namespace

Outcome<std::unique_ptr<AioQueue>> AioQueue::open(int most_in_flight) {
  io_context_t context = nullptr;
  if (const int code = io_setup(most_in_flight, &context); code != 0) {
    return Error{std::string{"asynchronous transfers are not available: "} + std::strerror(-code) +
                 "; is /proc/sys/fs/aio-max-nr used up?"};
  }
  io::Descriptor completions{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  if (!completions) {
    const int code = errno;
    io_destroy(context);
    return Error{std::string{"no descriptor for transfers: "} + std::strerror(code)};
  }
  return std::unique_ptr<AioQueue>{new AioQueue{context, std::move(completions)}};
}

AioQueue::~AioQueue() {
  io_destroy(context_);  // the kernel gives all memory back first
}

bool AioQueue::read(int endpoint, Transfer& transfer) {
  io_prep_pread(&transfer.control, endpoint, transfer.bytes.data(), transfer.bytes.size(), 0);
  return submit(transfer);
}

bool AioQueue::write(int endpoint, Transfer& transfer) {
  io_prep_pwrite(&transfer.control, endpoint, transfer.bytes.data(), transfer.filled, 0);
  return submit(transfer);
}

bool AioQueue::submit(Transfer& transfer) {
  io_set_eventfd(&transfer.control, completions_.get());
  transfer.control.data = &transfer;
  iocb* list = &transfer.control;
  if (io_submit(context_, 1, &list) != 1) return false;
  transfer.stage = Transfer::Stage::in_flight;
  ++in_flight_;
  return true;
}

void AioQueue::cancel(Transfer& transfer) {
  io_event unused{};
  if (transfer.stage == Transfer::Stage::in_flight) io_cancel(context_, &transfer.control, &unused);
}

void AioQueue::reap() {
  std::array<io_event, kAtOnce> events;
  timespec at_once{};
  int got = 0;
  do {
    got = io_getevents(context_, 0, kAtOnce, events.data(), &at_once);
    if (got > 0) take(std::span{events}.first(static_cast<std::size_t>(got)));
  } while (got == kAtOnce);
}

void AioQueue::nudge() {
  eventfd_write(completions_.get(), 1);
}

void AioQueue::drain() {
  std::array<io_event, kAtOnce> events;
  while (in_flight_ > 0) {
    const int got = io_getevents(context_, 1, kAtOnce, events.data(), nullptr);
    if (got <= 0 && got != -EINTR) return;
    if (got > 0) take(std::span{events}.first(static_cast<std::size_t>(got)));
  }
}

void AioQueue::take(std::span<const io_event> events) {
  for (const auto& event : events) {
    auto& transfer = *static_cast<Transfer*>(event.data);
    transfer.result = static_cast<std::int64_t>(event.res);
    transfer.stage = Transfer::Stage::done;
    --in_flight_;
  }
}

}  // namespace probebox::usb_gadget
