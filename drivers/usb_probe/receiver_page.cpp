// Writes RECEIVER.md from the field lists. `receiver_page` prints it; `receiver_page --check FILE` fails when the file
// says something else.
#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include "protocol/messages/reference_table.hpp"
#include "protocol/receiver/packet.hpp"
#include "protocol/usb/interface.hpp"

namespace probebox::usb_probe {
namespace {

std::string interfaceClass() {
  std::array<char, 16> text{};
  const auto& [interface_class, subclass, protocol] = usb::kReceiver;
  std::snprintf(text.data(), text.size(), "%02x/%02x/%02x", unsigned{interface_class}, unsigned{subclass},
                unsigned{protocol});
  return text.data();
}

std::string faults() {
  std::string rows;
  for (const auto& [fault, name, meaning] : kReceiverFaults)
    rows += "| " + std::to_string(static_cast<unsigned>(fault)) + " | `" + std::string{name} + "` | " +
            std::string{meaning} + " |\n";
  return rows;
}

std::string page() {
  return R"(# A probe receiver on USB

How to build a probe receiver that the box understands. Generated from the field lists in protocol/receiver/packet.hpp by
`cmake --build build --target receiver-page`; do not edit.

The box finds a receiver by the class of an interface, )" +
         interfaceClass() +
         R"( (class/subclass/protocol), never by vendor and product numbers. That
interface has one bulk IN endpoint. A serial number string distinguishes two receivers: `probe = "usb:SERIAL"` in box.toml.

## Packet
A header, `count` samples, and the CRC-32C (Castagnoli) of both as u32. All numbers are little endian, without padding.

)" + messages::packedTable<PacketHeader>() +
         "\n" + "Each of the samples has " + std::to_string(kSampleBytes) + " bytes:\n\n" +
         messages::packedTable<Sample>() + "\n" +
         R"(## Axis counters (version 2)
A receiver may count the encoders of the axes as well, on the same sample counter as the deflections. Then the delay between
probe and machine data is that of the receiver's own inputs, and no operating system takes part in it. `[encoder.X] kind =
"receiver"` of box.toml names the counter of an axis. Version 1 remains for receivers without counters.

After the header:

)" + messages::packedTable<CountersHeader>() +
         "\n" +
         R"(After each of the samples come the counts of all counters, i64 each, latched at the instant at which the sample's deflection was
taken. They do not wrap. After the last sample come the index latches, )" +
         std::to_string(kLatchBytes) + " bytes each:\n\n" + messages::packedTable<IndexLatch>() + "\n" +
         R"(- Counts go on over lost packets, and over a new host. When they may not (power failure, reset) raise `run`: the box then takes
  the axes as not referenced, unless their encoders are absolute.
- A latch goes with the packet in which the sample after the pulse is, or in the one before. Latch with a filter as fast as the
  counter's own.
- Absolute encoders (SSI, BiSS-C, EnDat) are read at the sample and sent as a count; `absolute = true` in box.toml marks them. A
  failed reading is a counter fault (bit 8 + k of `status`) with the last good count.
- A broken wire or an impossible transition of A and B is a counter fault too. The axis is then referenced anew.
- When an incremental counter has lost counts, its bit stays set until the host has taken a packet with it (its transfer has
  completed), because the box keeps the reference of an axis over packets that were dropped or discarded. The bit of a failed
  reading of an absolute encoder goes with its own sample only.

## Edges of lines (version 3)
A receiver may stamp the edges of lines as well: the sync line of the control, triggers, inhibit, a loop-back. Between counts,
deflections and edges of one receiver no operating system takes part then. Version 3 is version 2 with this header after the
CountersHeader (`counters` may be 0):

)" + messages::packedTable<EdgesHeader>() +
         "\n" + "After the index latches come the edges in the order of their times, " + std::to_string(kEdgeBytes) +
         " bytes each:\n\n" + messages::packedTable<LineEdge>() + "\n" +
         R"(- An edge goes with the packet in which the sample after it is, or in the one before.
- `levels` tells a host that begins to listen, or has lost packets, how the lines are now.
- An edge that does not fit into a packet is lost: the next one of its line says so in `lost`, and `sequence` has a gap.

Faults, as bits of `faults`. Those of a moment stay until the host has taken a packet with them.

| bit | name | meaning |
|---|---|---|
)" + faults() +
         R"(
## Rules
- The counter counts every sample on the receiver's own oscillator, which must be within 200 ppm of `rate_hz` in probe.toml. A
  sample that is not sent is counted nevertheless: the gap tells the box how many are missing.
- Send a packet as soon as its last sample has been taken, and end the USB transfer there (with a zero-length packet if its
  size is a multiple of the endpoint's). The box knows only the arrival time of a transfer: a constant delay is found by the
  system-delay calibration, a varying one is noise. Packets of 1 to 8 ms are a good choice.
- USB polls a device at fixed times (every 125 us, or every ms at full speed). The packet period should not be a multiple of
  that. At 1999 Hz the waiting times of packets of 10 samples average out and sample times are right to 0.2 us. At 2000 Hz the
  waiting time drifts from 0 to 125 us within minutes; the box's clock follows it, and its sigma does not show the error.
- A transfer may hold several packets, and a packet may span several transfers. Only the last sample of a transfer then gives
  a time, and only if a packet ends with it.
- SET_INTERFACE with alternate setting 0 means that a new host listens: discard what is queued. The counter continues.
- When no host reads, drop packets instead of queueing them: samples older than 100 ms are useless.
)";
}

}  // namespace
}  // namespace probebox::usb_probe

int main(int argc, char** argv) {
  return probebox::messages::printOrCheck(argc, argv, probebox::usb_probe::page(), "receiver-page");
}
