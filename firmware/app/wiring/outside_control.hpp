#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "board/describe/world.hpp"
#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "drivers/world/following.hpp"
#include "drivers/world/world.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Lets a program on this computer lead the emulated machine, by lines of text over TCP ([outside_control] in
// board/sim/world.toml explains them). One at a time: another one waits until the first has gone.
class OutsideControl {
 public:
  static Outcome<std::unique_ptr<OutsideControl>> open(const board::World& description, world::World& world);

  // Does and answers what has been sent. Never blocks.
  void serve(MonoTime now);
  // As far as the world may advance.
  MonoTime known(MonoTime now) const { return following_.known(now); }

 private:
  OutsideControl(const board::World& description, world::World& world, tcp::Listener listener);
  void receive();
  std::string answer(std::string_view line, MonoTime now);
  std::optional<std::string> take(std::string_view values, MonoTime now);
  void send();

  bool swivels_head_, tilts_table_;  // by B
  world::World& world_;
  world::Following following_;
  tcp::Listener listener_;
  std::unique_ptr<io::BytePipe> control_;
  std::string received_, unsent_;
};

}  // namespace probebox::app
