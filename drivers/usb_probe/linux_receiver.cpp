#include "drivers/usb_probe/linux_receiver.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/usb_host/bulk_in.hpp"
#include "drivers/usb_host/claimed_interface.hpp"
#include "drivers/usb_host/hot_plug.hpp"

namespace probebox::usb_probe {
namespace {

using usb_host::ClaimedInterface;
using usb_host::EndpointState;
using usb_host::HotPlug;
using usb_host::OpenError;

const char* remedyFor(EndpointState state) {
  switch (state) {
    case EndpointState::stalled:
      return "it refuses to send (stall); plug it in again";
    case EndpointState::failed:
      return "its transfers fail; try another cable or port";
    default:
      return "it was unplugged; plug it in again";
  }
}

// The rule for a person at a computer does not help a daemon.
OpenError notPermitted(const usb_host::Device& device) {
  return {OpenError::Kind::no_permission, "usb:" + device.name() + ": no permission to open " + device.node +
                                              "; install 60-probeboxd.rules (docs/service.md), and plug it in again"};
}

}  // namespace

struct LinuxReceiver::Connection {
  explicit Connection(std::unique_ptr<ClaimedInterface> claimed) : interface {
    std::move(claimed)
  }, in{*interface, interface->device().endpoints.front()} {
  }

  std::unique_ptr<ClaimedInterface> interface;
  usb_host::BulkIn in;
};

LinuxReceiver::LinuxReceiver(std::string name, const Wiring& wiring, std::optional<front_end::Settings> settings)
    : wiring_{wiring},
      wanted_{std::move(name)},
      name_{std::string{wiring.number == 0 ? "probe receiver" : "second receiver"} +
            (wanted_.empty() ? " on USB" : " usb:" + wanted_)},
      settings_{settings},
      decoder_{wiring.axes, wiring.lines, wiring.number} {}

LinuxReceiver::~LinuxReceiver() = default;

int LinuxReceiver::descriptor() const {
  if (connection_) return connection_->interface->context().descriptor();
  return plug_ ? plug_->descriptor() : -1;
}

std::size_t LinuxReceiver::read(std::span<Event> into, MonoTime now) {
  if (into.empty()) return 0;
  const bool is_all_reported =
      !loss_unreported_ && !encoder_loss_unreported_ && !sync_loss_unreported_ && !line_loss_unreported_;
  if (!connection_ && is_all_reported) look(now);
  std::size_t count = 0;
  if (connection_) {
    count = drain(into);
    judge();
    noteVersion();
    showFaults(now);
    if (connection_->in.over() && decoder_.idle()) lose(now);
  }
  return count + deliverLosses(into.subspan(count), now);
}

std::size_t LinuxReceiver::deliverLosses(std::span<Event> into, MonoTime now) {
  std::size_t count = 0;
  if (count < into.size() && std::exchange(loss_unreported_, false))
    into[count++] = SourceLost{Source::probe, LossReason::disconnected, 0, now};
  if (count < into.size() && std::exchange(encoder_loss_unreported_, false))
    into[count++] = SourceLost{Source::encoders, LossReason::disconnected, 0, now, decoder_.axes()};
  if (count < into.size() && std::exchange(sync_loss_unreported_, false))
    into[count++] = SourceLost{Source::sync, LossReason::disconnected, 0, now};
  if (count < into.size() && std::exchange(line_loss_unreported_, false))
    into[count++] = SourceLost{Source::trigger, LossReason::disconnected, 0, now};
  return count;
}

// Tries when something was plugged in, and now and then.
void LinuxReceiver::look(MonoTime now) {
  const bool is_time = now >= next_try_;
  if (!plug_ && is_time) {
    auto plug = HotPlug::watch(usb::kReceiver);
    if (plug) plug_ = std::move(*plug);
    if (!plug) problem_ = plug.error().what;
  }
  const bool has_changed = plug_ && !plug_->poll().empty();
  if (!is_time && !has_changed) return;
  next_try_ = now + kRetry;
  if (!plug_) return;
  const auto connected = connect(now);
  problem_ = connected ? std::string{} : connected.error().what;
  using Kind = OpenError::Kind;
  if (!connected && (connected.error().kind == Kind::absent || connected.error().kind == Kind::gone)) forget();
}

void LinuxReceiver::forget() {
  if (!front_end_ && serial_number_.empty() && packet_version_ == 0) return;
  front_end_.reset();
  serial_number_.clear();
  packet_version_ = 0;
  ++changes_;
}

Outcome<void, OpenError> LinuxReceiver::connect(MonoTime now) {
  TRY(const auto chosen, usb_host::choose(plug_->there(), wanted_, usb::kReceiver));
  auto claimed = ClaimedInterface::open(usb::kReceiver, wanted_);
  if (!claimed && claimed.error().kind == OpenError::Kind::no_permission) return notPermitted(chosen);
  if (!claimed) return claimed.error();
  const auto& endpoints = (*claimed)->device().endpoints;
  if (endpoints.empty() || !endpoints.front().in) {
    return OpenError{OpenError::Kind::failed,
                     "usb:" + (*claimed)->device().name() +
                         " has no bulk IN endpoint where a probe receiver has one; its firmware version may not match"};
  }
  TRY(askAndSet(**claimed, now));
  connection_ = std::make_unique<Connection>(std::move(*claimed));
  at_connect_ = decoder_.counters();
  in_transfer_ = false;
  return {};
}

// A front end that has just started has its own settings. Where they change, samples of before are discarded.
Outcome<void, OpenError> LinuxReceiver::askAndSet(ClaimedInterface& claimed, MonoTime now) {
  const usb_host::VendorRequests requests{claimed.handle()};
  serial_number_ = claimed.device().serial_number;
  front_end_ = askFrontEnd(requests);
  ++changes_;
  if (!settings_) return {};
  const auto failed = [&](const std::string& why) {
    next_try_ = now + kRetryOfSettings;
    return OpenError{OpenError::Kind::failed, "usb:" + claimed.device().name() + ": " + why};
  };
  if (!front_end_)
    return failed(
        "it does not know the settings of [front_end] in box.toml: remove that section, or update its program");
  if (front_end_->settings == *settings_) return {};
  if (const auto error = setFrontEnd(requests, *settings_)) return failed(error->what);
  front_end_->settings = *settings_;
  TRY(claimed.reset());
  return {};
}

std::size_t LinuxReceiver::drain(std::span<Event> into) {
  auto& in = connection_->in;
  connection_->interface->context().handle();
  std::size_t count = 0;
  while (count < into.size()) {
    // Samples of a transfer whose bytes are all taken come before the next one.
    const bool takes_bytes = in_transfer_ || decoder_.idle();
    auto bytes = takes_bytes ? in.front() : std::span<const std::byte>{};
    if (bytes.empty() && decoder_.idle()) break;
    if (takes_bytes && !std::exchange(in_transfer_, true)) decoder_.begin(bytes, in.arrived(), !in.hasMore());
    const std::size_t before = bytes.size();
    count += decoder_.read(bytes, into.subspan(count));
    in_transfer_ = !bytes.empty();
    if (before > bytes.size()) in.consume(before - bytes.size());
  }
  return count;
}

void LinuxReceiver::lose(MonoTime now) {
  problem_ = remedyFor(connection_->in.state());
  connection_.reset();
  decoder_.restart();
  forget();
  const bool is_first = wiring_.number == 0;
  loss_unreported_ = is_first;  // the probe is on it
  encoder_loss_unreported_ = decoder_.axes() != 0;
  for (const auto& line : decoder_.lines())
    if (line && (is_first || line->role != LineRole::sync))  // of the second it is the first's
      (line->role == LineRole::sync ? sync_loss_unreported_ : line_loss_unreported_) = true;
  next_try_ = now + kRetry;
}

void LinuxReceiver::judge() {
  auto problem = problemOfPackets();
  if (problem != problem_) problem_ = std::move(problem);
}

// A receiver that says nothing but what this build does not know, or less than it is asked for.
std::string LinuxReceiver::problemOfPackets() const {
  const auto& counters = decoder_.counters();
  const bool is_understood = counters.packets > at_connect_.packets;
  if (!is_understood)
    return counters.bad_version > at_connect_.bad_version
               ? "it sends packets of a version that this firmware does not know; update the older of the two"
               : problem_;
  for (std::size_t i = decoder_.axisCounters(); i < wiring_.axes.size(); ++i) {
    if (wiring_.axes[i])
      return "it sends " + std::to_string(decoder_.axisCounters()) + " axis counters, and [encoder." +
             letterOf(*wiring_.axes[i]) + "] of box.toml reads number " + std::to_string(i) +
             " (from 0): correct 'channel', or let the receiver send packets of version 2 with that counter";
  }
  const auto has_lines = std::ranges::any_of(decoder_.lines(), [](const auto& line) { return line.has_value(); });
  if (has_lines && decoder_.version() != PacketHeader::kWithEdges)
    return "it sends packets of version " + std::to_string(decoder_.version()) +
           ", which have no edges, and lines of box.toml are on the receiver: let it send version 3, or wire them to a "
           "gpio chip";
  return {};
}

// A fault of a moment is in one packet alone, and a person looks now and then.
void LinuxReceiver::showFaults(MonoTime now) {
  // Nobody reads the deflections of a second one.
  constexpr unsigned kOfDeflections =
      unsigned{bitOf(ReceiverFault::converter_silent)} | bitOf(ReceiverFault::deflections_late);
  const unsigned seen = decoder_.takeFaults() & (wiring_.number == 0 ? ~0U : ~kOfDeflections);
  faults_ = 0;
  for (const auto& of_bit : kReceiverFaults) {
    const unsigned bit = bitOf(of_bit.fault);
    auto& last = fault_seen_.at(static_cast<std::size_t>(of_bit.fault));
    if ((seen & bit) != 0) last = now;
    if (last && now - *last < kShown) faults_ |= bit;
  }
}

std::span<const io::SourceFault> LinuxReceiver::faultNames() const {
  static constexpr auto kNames = [] {
    std::array<io::SourceFault, kReceiverFaults.size()> names{};
    for (const auto& [fault, name, meaning] : kReceiverFaults)
      names.at(static_cast<std::size_t>(fault)) = {name, meaning};
    return names;
  }();
  return kNames;
}

void LinuxReceiver::noteVersion() {
  if (decoder_.version() == packet_version_) return;
  packet_version_ = decoder_.version();
  ++changes_;
}

}  // namespace probebox::usb_probe
