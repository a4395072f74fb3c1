#include "firmware/app/board_sources.hpp"

#include <string>
#include <utility>

#include "drivers/gpio/lines.hpp"
#include "firmware/app/controller_link.hpp"
#include "firmware/app/gpio_chip.hpp"
#include "firmware/app/sim_source.hpp"

namespace probebox::app {
namespace {

using Sources = std::vector<std::unique_ptr<io::EventSource>>;

Outcome<Sources> openSim(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  if (!descriptions.world) {
    return Error{
        "box.toml asks for the emulated machine (sim), but there is no world.toml beside it: add one, such as that of "
        "board/sim."};
  }
  Sources sources;
  sources.push_back(std::make_unique<SimSource>(*descriptions.world, descriptions.machine,
                                                std::make_unique<ControllerLink>(box), now));
  return sources;
}

Outcome<Sources> openLines(const board::Box& box) {
  Sources sources;
  for (auto& chip : gpio::linesByChip(box)) {
    auto opened = gpio::LinuxGpio::open(std::move(chip));
    if (!opened) return opened.error();
    sources.push_back(std::make_unique<GpioChip>(std::move(*opened)));
  }
  return sources;
}

}  // namespace

Outcome<Sources> openSources(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  const auto& devices = descriptions.box.devices;
  if (devices.encoders == "sim" && devices.probe == "sim") return openSim(descriptions, box, now);
  if (devices.encoders == "none" && devices.probe == "none") return openLines(descriptions.box);
  return Error{"box.toml, [devices]: encoders = \"" + devices.encoders + "\" with probe = \"" + devices.probe +
               "\" is not in this build. It has: both \"sim\" (the emulated machine), or both \"none\" (lines only)."};
}

}  // namespace probebox::app
