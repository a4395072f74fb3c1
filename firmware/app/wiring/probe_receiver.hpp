#pragma once
#include <string>
#include <string_view>

#include "drivers/io/event_source.hpp"
#include "drivers/usb_probe/linux_receiver.hpp"
#include "firmware/app/threads/counters.hpp"

namespace probebox::app {

// A probe receiver whose damaged packets are counted for status.
class ProbeReceiver final : public io::EventSource {
 public:
  // serial_number: empty for the only receiver. `counters` must outlive this.
  ProbeReceiver(std::string serial_number, const usb_probe::CounterAxes& axes, Counters& counters)
      : receiver_{std::move(serial_number), axes}, counters_{counters} {}

  std::size_t read(std::span<Event> into, MonoTime now) override {
    const std::size_t count = receiver_.read(into, now);
    counters_.receiver_bad_packets = receiver_.packets().bad();
    return count;
  }
  int descriptor() const override { return receiver_.descriptor(); }
  std::string_view name() const override { return receiver_.name(); }
  std::string_view problem() const override { return receiver_.problem(); }

 private:
  usb_probe::LinuxReceiver receiver_;
  Counters& counters_;
};

}  // namespace probebox::app
