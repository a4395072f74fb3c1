#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/world/world.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Lets a control outside lead the machine, on its own time: its cycles follow one another evenly however late each is
// told, so a motion has the speed that the control gave it. The machine does what it is told `late` afterwards;
// meanwhile the cycles may come in bunches. Where one is later still, the world waits for it. At rest the two times are
// matched anew.
class Following {
 public:
  struct Config {
    Nanoseconds cycle{1'000'000};
    Nanoseconds late{150'000'000};
    Nanoseconds patience{1'000'000'000};  // a control that is silent for so long does not move any more
  };

  Following(const Config& config, World& world) : config_{config}, world_{world} {}

  // Tells why the command is impossible, such as a jump; nothing has changed then.
  std::optional<std::string> take(const Lead& lead, MonoTime now);
  // Until when it is known what the machine does: as far as the world may advance.
  MonoTime known(MonoTime now) const;

 private:
  Config config_;
  World& world_;
  std::optional<Lead> last_;
  MonoTime told_{};   // when
  MonoTime until_{};  // end of the last cycle
};

}  // namespace probebox::world
