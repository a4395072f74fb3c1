#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "drivers/io/event_source.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "drivers/usb_probe/decode.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_host {
class HotPlug;
}

namespace probebox::usb_probe {

// The samples of a probe receiver on USB. It need not be there yet, and may come and go: whenever it goes, SourceLost
// comes once; when it is plugged in (or can be opened, after all), samples come again.
// Each sample bears the time at which its transfer came back, read in libusb's callback; that is later than `now`.
class LinuxReceiver final : public io::EventSource {
 public:
  // How long it waits, where no plugging in tells it to look, before it tries again.
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};

  // name: serial number or place ("1-1.4") of the receiver; empty for the only one there is.
  explicit LinuxReceiver(std::string name);
  ~LinuxReceiver() override;

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override;
  std::string_view name() const override { return name_; }
  // What is not there, not permitted, in use by whom, or not understood.
  std::string_view problem() const override { return problem_; }

  const PacketCounters& packets() const { return decoder_.counters(); }

 private:
  struct Connection;

  void look(MonoTime now);
  Outcome<bool, usb_host::OpenError> connect();
  std::size_t drain(std::span<Event> into);
  void lose(MonoTime now);
  void judge();

  std::string wanted_;
  std::string name_;
  std::string problem_;
  std::unique_ptr<usb_host::HotPlug> plug_;
  std::unique_ptr<Connection> connection_;
  ReceiverDecoder decoder_;
  PacketCounters at_connect_;
  bool in_transfer_{};  // some of the front transfer's bytes are still to be decoded
  bool loss_untold_{};
  MonoTime next_try_{};
};

}  // namespace probebox::usb_probe
