#include "played_receiver.hpp"

#include <algorithm>
#include <utility>

#include "protocol/usb/interface.hpp"

namespace probebox::vm {
namespace {

using usb_gadget::BusEvent;
using usb_gadget::Transfer;

constexpr std::size_t kTransfers = 16;

usb_gadget::Function receiverFunction() {
  return {usb::kReceiver, "probe receiver", "{2d0c63f4-50ab-4f0c-9d3e-5a8c5b1f0002}", {usb_gadget::Direction::in}};
}

// Nothing here makes pulses of an index.
std::size_t bytesOf(const usb_probe::EmulatedReceiver::Config& config) {
  return config.counters == 0 ? usb_probe::packetBytes(config.samples_a_packet)
                              : usb_probe::packetBytes(config.samples_a_packet, config.counters, 0);
}

}  // namespace

PlayedReceiver::PlayedReceiver(const usb_probe::EmulatedReceiver::Config& config,
                               usb_probe::EmulatedReceiver::Waveform waveform, MonoTime start,
                               usb_probe::EmulatedReceiver::Counts counts)
    : device_{config, std::move(waveform), start, std::move(counts)},
      samples_a_packet_{config.samples_a_packet},
      transfers_(kTransfers) {
  for (auto& transfer : transfers_) transfer.bytes.resize(bytesOf(config));
}

Outcome<std::unique_ptr<PlayedReceiver>> PlayedReceiver::open(const usb_probe::EmulatedReceiver::Config& config,
                                                              usb_probe::EmulatedReceiver::Waveform waveform,
                                                              MonoTime start, const std::filesystem::path& mount,
                                                              const std::filesystem::path& gadget,
                                                              const std::string& controller,
                                                              usb_probe::EmulatedReceiver::Counts counts) {
  if (bytesOf(config) % usb_gadget::kLargestPacket == 0 || bytesOf(config) % 512 == 0) {
    return Error{"a packet of that many samples fills its USB packets, and nothing would end the transfer"};
  }
  std::unique_ptr<PlayedReceiver> played{new PlayedReceiver{config, std::move(waveform), start, std::move(counts)}};
  TRY(auto queue, usb_gadget::AioQueue::open(kTransfers));
  played->queue_ = std::move(queue);
  TRY(auto function, usb_gadget::FunctionFs::open(mount, receiverFunction()));
  played->function_ = std::move(function);
  TRY(usb_gadget::bindGadget(gadget, controller));
  return played;
}

PlayedReceiver::~PlayedReceiver() {
  if (!queue_) return;
  for (auto& transfer : transfers_) queue_->cancel(transfer);
  queue_->drain();
}

void PlayedReceiver::turn(MonoTime now) {
  takeBusEvents();
  settle();
  while (true) {
    const auto packet = device_.packet(now);
    if (packet.empty()) return;
    send(packet);
  }
}

// A host that selects the interface anew finds nothing of before: the kernel has given the transfers back.
void PlayedReceiver::takeBusEvents() {
  while (const auto event = function_->next()) {
    if (*event == BusEvent::enabled) enabled_ = true;
    if (*event == BusEvent::disabled || *event == BusEvent::unbound) enabled_ = false;
  }
}

void PlayedReceiver::settle() {
  queue_->reap();
  for (auto& transfer : transfers_) {
    if (transfer.stage != Transfer::Stage::done) continue;
    const bool is_delivered = transfer.result == static_cast<std::int64_t>(transfer.filled);
    (is_delivered ? counts_.delivered : counts_.returned) += samples_a_packet_;
    transfer.stage = Transfer::Stage::idle;
  }
}

void PlayedReceiver::send(std::span<const std::byte> packet) {
  if (mute_ || to_drop_ > 0) {
    if (!mute_) --to_drop_;
    counts_.withheld += samples_a_packet_;
    return;
  }
  const auto idle = std::ranges::find(transfers_, Transfer::Stage::idle, &Transfer::stage);
  if (!enabled_ || idle == transfers_.end()) {
    counts_.refused += samples_a_packet_;
    return;
  }
  std::ranges::copy(packet, idle->bytes.begin());
  idle->filled = packet.size();
  if (to_corrupt_ > 0) {
    --to_corrupt_;
    idle->bytes[usb_probe::kHeaderBytes] ^= std::byte{1};
  }
  if (!queue_->write(function_->endpoint(0), *idle)) counts_.refused += samples_a_packet_;
}

PlayedCounts PlayedReceiver::counts() const {
  PlayedCounts counts = counts_;
  counts.taken = device_.samples();
  return counts;
}

}  // namespace probebox::vm
