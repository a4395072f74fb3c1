#pragma once
#include <cstddef>
#include <cstdint>
#include <libaio.h>
#include <memory>
#include <span>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/units/outcome.hpp"

// Asynchronous kernel I/O on endpoint files: several transfers in flight per endpoint, completions on one descriptor,
// no thread.
namespace probebox::usb_gadget {

// One transfer and its memory, which the kernel reads or writes while it is in flight.
struct Transfer {
  enum class Stage : std::uint8_t { idle, in_flight, done };

  iocb control{};
  std::vector<std::byte> bytes;
  std::size_t filled{};  // bytes to send, or bytes received
  std::size_t taken{};   // by a reader
  std::int64_t result{};
  Stage stage{Stage::idle};
};

// All transfers of one function.
class AioQueue {
 public:
  static Outcome<std::unique_ptr<AioQueue>> open(int most_in_flight);
  ~AioQueue();
  AioQueue(const AioQueue&) = delete;
  AioQueue& operator=(const AioQueue&) = delete;

  // Becomes readable at each completion and stays so: watch it edge-triggered.
  int descriptor() const { return completions_.get(); }

  // Returns false when the endpoint is not enabled.
  bool read(int endpoint, Transfer& transfer);
  bool write(int endpoint, Transfer& transfer);
  // Cancels a transfer; it completes like any other.
  void cancel(Transfer& transfer);

  // Marks completed transfers as done.
  void reap();
  // Signals the descriptor like a completion: completed data are still unread.
  void nudge();
  // Waits for all transfers in flight; the caller has cancelled them.
  void drain();

  std::size_t inFlight() const { return in_flight_; }

 private:
  AioQueue(io_context_t context, io::Descriptor completions)
      : context_{context}, completions_{std::move(completions)} {}
  bool submit(Transfer& transfer);
  void take(std::span<const io_event> events);

  io_context_t context_;
  io::Descriptor completions_;
  std::size_t in_flight_{};
};

}  // namespace probebox::usb_gadget
