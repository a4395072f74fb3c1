#pragma once
#include <linux/gpio.h>
#include <linux/serial.h>
#include <memory>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Turns the transceiver of a half-duplex line.
class Transceiver {
 public:
  virtual ~Transceiver() = default;
  // True: to sending. Returns false when the device is gone.
  virtual bool turn(bool sending) = 0;
  // Waits until the driver has sent what it took.
  virtual void drain() = 0;
};

// A line whose transceiver this program turns. A write takes all bytes and returns when the last bit has left and the
// line listens again: nothing arrives meanwhile. What the driver does not take within a second counts as not sent.
std::unique_ptr<io::BytePipe> turnedPipe(std::unique_ptr<io::BytePipe> line, std::unique_ptr<Transceiver> transceiver,
                                         const Settings& settings);

// What TIOCSRS485 is asked for.
serial_rs485 kernelRequest(const Rs485& rs485);
// What a gpio chip is asked for: an output that listens.
gpio_v2_line_request gpioRequest(unsigned offset, const Rs485& rs485);

// Lets the driver turn. The error says what it cannot.
Outcome<void> turnByKernel(int line, const Rs485& rs485);
// For rs485.by == rts or gpio, of an open line that outlives it; the transceiver listens from then on.
Outcome<std::unique_ptr<Transceiver>> openTransceiver(int line, const Rs485& rs485);

}  // namespace probebox::serial
