#include "firmware/app/board_sources.hpp"

#include <string>
#include <utility>

#include "drivers/gpio/lines.hpp"
#include "firmware/app/controller_link.hpp"
#include "firmware/app/gpio_line.hpp"
#include "firmware/app/sim_source.hpp"

namespace probebox::app {
namespace {

using Sources = std::vector<std::unique_ptr<io::EventSource>>;

Sources openSim(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  Sources sources;
  sources.push_back(std::make_unique<SimSource>(*descriptions.world, descriptions.machine,
                                                std::make_unique<ControllerLink>(box), now));
  return sources;
}

// Lines that cannot be had yet are asked for while the box runs.
Sources openLines(const board::Box& box) {
  Sources sources;
  for (auto& line : gpio::linesApart(box)) sources.push_back(std::make_unique<GpioLine>(std::move(line)));
  return sources;
}

}  // namespace

bool isEmulated(const board::Descriptions& descriptions) {
  return descriptions.box.devices.encoders == "sim" && descriptions.box.devices.probe == "sim";
}

std::optional<Error> whyUnsupported(const board::Descriptions& descriptions) {
  const auto& devices = descriptions.box.devices;
  if (isEmulated(descriptions)) {
    if (descriptions.world) return std::nullopt;
    return Error{
        "box.toml asks for the emulated machine (sim), but there is no world.toml beside it: add one, such as that of "
        "board/sim."};
  }
  if (devices.encoders == "none" && devices.probe == "none") return std::nullopt;
  return Error{"box.toml, [devices]: encoders = \"" + devices.encoders + "\" with probe = \"" + devices.probe +
               "\" is not in this build. It has: both \"sim\" (the emulated machine), or both \"none\" (lines only)."};
}

Outcome<Sources> openSources(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  if (auto refused = whyUnsupported(descriptions)) return *refused;
  return isEmulated(descriptions) ? openSim(descriptions, box, now) : openLines(descriptions.box);
}

}  // namespace probebox::app
