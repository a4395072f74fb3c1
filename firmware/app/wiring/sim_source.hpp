#pragma once
#include <memory>
#include <optional>
#include <string_view>

#include "board/describe/machine.hpp"
#include "board/describe/world.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/world/box_link.hpp"
#include "drivers/world/controller.hpp"
#include "drivers/world/world.hpp"
#include "firmware/app/wiring/outside_control.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Replaces all drivers by the emulated machine. Its controller runs in the same thread and reaches the box only through
// `link`; where world.toml names an outside control, that one leads the machine instead.
class SimSource : public io::EventSource {
 public:
  static Outcome<std::unique_ptr<SimSource>> open(const board::World& world, const board::Machine& machine,
                                                  std::unique_ptr<world::BoxLink> link, MonoTime start);
  SimSource(const board::World& world, const board::Machine& machine, std::unique_ptr<world::BoxLink> link,
            MonoTime start);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "the emulated machine"; }

 private:
  void advanceTo(MonoTime now);

  world::World world_;
  std::unique_ptr<world::BoxLink> link_;
  world::Controller controller_;
  std::unique_ptr<OutsideControl> outside_control_;
  MonoTime reached_;
};

}  // namespace probebox::app
