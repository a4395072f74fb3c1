#include "receiver_with_axes.hpp"

#include <stdexcept>

namespace probebox::vm {
namespace {

constexpr std::array<int, 3> kSense{1, -1, 1};  // of machine.toml

}  // namespace

ReceiverWithAxes::ReceiverWithAxes(const world::Config& config, const world::Machine& machine) : truth_{config} {
  // Packets come at an interval that has nothing to do with how often the bus is looked at.
  const usb_probe::EmulatedReceiver::Config receiver{
      .rate_hz = kRateHz, .offset_ppm = 35, .range_um = 1200, .samples_a_packet = 7, .counters = 3};
  const MonoTime start = kernelNow();
  auto played = PlayedReceiver::open(
      receiver,
      [this, &machine, start](Nanoseconds since_start) {
        const auto nm = truth_.channels(machine, start + since_start);
        return std::array{Micrometres{1e-3 * nm[0]}, Micrometres{1e-3 * nm[1]}, Micrometres{1e-3 * nm[2]}};
      },
      start, ReceiverGadget::kMount, ReceiverGadget::kFolder, ReceiverGadget::kController,
      [this, &machine, start](Nanoseconds since_start) {
        std::array<std::int64_t, usb_probe::kMostCounters> counts{};
        for (std::size_t axis = 0; axis < kSense.size(); ++axis)
          counts[axis] = kSense[axis] * truth_.counts(machine, axis, start + since_start);
        return counts;
      });
  if (!played) throw std::runtime_error{played.error().what};
  device_ = std::move(*played);
}

void ReceiverWithAxes::play(const world::Machine&) {
  device_->turn(kernelNow());
}

}  // namespace probebox::vm
