#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/io/event_source.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "drivers/usb_probe/decode.hpp"
#include "drivers/usb_probe/front_end.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_host {
class ClaimedInterface;
class HotPlug;
}  // namespace probebox::usb_host

namespace probebox::usb_probe {

// Reads samples of a probe receiver on USB that may be absent, appear and disappear. When it disappears, delivers
// SourceLost once for the probe, once for its encoders and once for its lines; samples follow when it can be opened
// again. Each sample carries the completion time of its transfer, read in libusb's callback, which may be later than
// `now`.
class LinuxReceiver final : public io::EventSource {
 public:
  // Retry interval without hot-plug events.
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};
  // Of one that does not take its settings: the other sources wait while it does not answer.
  static constexpr Nanoseconds kRetryOfSettings = std::chrono::seconds{10};
  // For so long after its last packet with it a fault is shown.
  static constexpr Nanoseconds kShown = std::chrono::minutes{1};

  // What it is read for.
  struct Wiring {
    CounterAxes axes{};     // to which its counters are wired
    WiredLines lines{};     // what its lines are for
    std::uint8_t number{};  // 0 the first, 1 the second, which has no probe
  };

  // name: serial number or place ("1-1.4") of the receiver; empty for the only one. settings: those that the
  // front end gets whenever it is connected.
  explicit LinuxReceiver(std::string name, const Wiring& wiring, std::optional<front_end::Settings> settings = {});
  explicit LinuxReceiver(std::string name) : LinuxReceiver{std::move(name), Wiring{}} {}
  ~LinuxReceiver() override;

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override;
  std::string_view name() const override { return name_; }
  // Why there are no samples: absent, no permission, in use, settings refused, or an unknown packet version; or fewer
  // axis counters or lines than are wired.
  std::string_view problem() const override { return problem_; }
  std::uint32_t faults() const override { return faults_; }
  std::span<const io::SourceFault> faultNames() const override;

  // What the receiver says of itself; null while it is not connected, or where it says nothing.
  const FrontEnd* frontEnd() const { return front_end_ ? &*front_end_ : nullptr; }
  std::string_view serialNumber() const { return serial_number_; }
  std::uint8_t packetVersion() const { return packet_version_; }  // 0 before its first packet
  // Counts the changes of these three.
  unsigned changes() const { return changes_; }

  const InputFigures& inputs() const { return decoder_.inputs(); }
  const PacketCounters& packets() const { return decoder_.counters(); }

 private:
  struct Connection;

  void look(MonoTime now);
  Outcome<void, usb_host::OpenError> connect(MonoTime now);
  Outcome<void, usb_host::OpenError> askAndSet(usb_host::ClaimedInterface& claimed, MonoTime now);
  std::size_t drain(std::span<Event> into);
  void lose(MonoTime now);
  void forget();
  void judge();
  std::string problemOfPackets() const;
  void showFaults(MonoTime now);
  void noteVersion();
  std::size_t deliverLosses(std::span<Event> into, MonoTime now);

  Wiring wiring_;
  std::string wanted_;
  std::string name_;
  std::string problem_;
  std::uint32_t faults_{};
  std::array<std::optional<MonoTime>, 16> fault_seen_{};
  std::optional<front_end::Settings> settings_;
  std::optional<FrontEnd> front_end_;
  std::string serial_number_;
  std::uint8_t packet_version_{};
  unsigned changes_{};
  std::unique_ptr<usb_host::HotPlug> plug_;
  std::unique_ptr<Connection> connection_;
  ReceiverDecoder decoder_;
  PacketCounters at_connect_;
  bool in_transfer_{};  // part of the front transfer is not decoded yet
  bool loss_unreported_{};
  bool encoder_loss_unreported_{};
  bool sync_loss_unreported_{};
  bool line_loss_unreported_{};
  MonoTime next_try_{};
};

}  // namespace probebox::usb_probe
