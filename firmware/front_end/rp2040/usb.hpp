#pragma once
#include <cstddef>
#include <cstdint>

#include "firmware/front_end/core/control.hpp"

namespace probebox::front_end {

// The device controller: endpoint 0 for Control, endpoint 1 IN for the packets of Assembly. Never waits.
class Usb {
 public:
  Usb(Control& control, Assembly& assembly) : control_{control}, assembly_{assembly} {}

  void start();
  void poll();
  void disconnect();

 private:
  enum class Stage : std::uint8_t { idle, data_in, data_out, status_in, status_out };

  void takeSetup();
  void answer(const Answer& answer);
  void stall();
  void controlSent();
  void controlReceived(std::size_t size);
  void beginAnew();
  void sendBulk();

  Control& control_;
  Assembly& assembly_;
  Stage stage_{Stage::idle};
  std::size_t sent_{};       // bytes of the packet at the front
  std::size_t in_flight_{};  // bytes of them that the controller has
  bool is_in_flight_{}, is_last_{}, data1_{};
};

}  // namespace probebox::front_end
