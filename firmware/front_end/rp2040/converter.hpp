#pragma once
#include <array>
#include <cstdint>

namespace probebox::front_end {

// An AD7606 in serial mode: CONVST starts the conversion of all channels, BUSY is high while it lasts, and 16 bits of
// each channel follow on DOUTA, the first three of which are read. Another converter has these four functions.
class Ad7606 {
 public:
  enum class State : std::uint8_t { idle, converting, reading, done, silent };

  void prepare();
  // CONVST has risen.
  void begin(std::uint32_t now_us);
  // Goes on as far as it can without waiting.
  State poll(std::uint32_t now_us);
  const std::array<std::int16_t, 3>& values() const { return values_; }

 private:
  State state_{State::idle};
  std::uint32_t begun_us_{};
  std::size_t read_{};
  std::array<std::int16_t, 3> values_{};
};

}  // namespace probebox::front_end
