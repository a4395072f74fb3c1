#pragma once
#include <cstddef>
#include <cstdint>
#include <libaio.h>
#include <memory>
#include <span>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/units/outcome.hpp"

// The kernel's asynchronous I/O on endpoint files: several transfers of an endpoint in flight at once, completions
// behind one descriptor, and no thread.
namespace probebox::usb_gadget {

// One transfer and its memory, which the kernel reads or writes while it is in flight.
struct Transfer {
  enum class Stage : std::uint8_t { idle, in_flight, done };

  iocb control{};
  std::vector<std::byte> bytes;
  std::size_t filled{};  // that go out, or that came in
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

  // Becomes readable each time that a transfer comes back, and stays so: to be watched for edges.
  int descriptor() const { return completions_.get(); }

  // False when the endpoint takes no transfer now: it is not enabled.
  bool read(int endpoint, Transfer& transfer);
  bool write(int endpoint, Transfer& transfer);
  // Asks for a transfer back; it comes like any other.
  void cancel(Transfer& transfer);

  // Marks the transfers that have come back as done.
  void reap();
  // Shows on the descriptor like a transfer that comes back: something that has come back is still to be read.
  void nudge();
  // Waits for all that are in flight; whoever calls has cancelled them.
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
