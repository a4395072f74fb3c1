#include "firmware/app/board_sources.hpp"

#include <utility>

#include "firmware/app/controller_link.hpp"
#include "firmware/app/sim_source.hpp"

namespace probebox::app {

Outcome<std::vector<std::unique_ptr<io::EventSource>>> openSources(const board::Descriptions& descriptions,
                                                                   const tcp::Address& box, MonoTime now) {
  std::vector<std::unique_ptr<io::EventSource>> sources;
  const auto& devices = descriptions.box.devices;
  for (const auto& device : {devices.encoders, devices.probe}) {
    if (device != "sim") {
      return Error{"box.toml, [devices]: this build has no driver '" + device +
                   "'. It has: sim (with a world.toml beside box.toml)."};
    }
  }
  if (!descriptions.world) {
    return Error{
        "box.toml asks for the emulated machine (sim), but there is no world.toml beside it: add one, such as that of "
        "--board sim."};
  }
  sources.push_back(std::make_unique<SimSource>(*descriptions.world, descriptions.machine,
                                                std::make_unique<ControllerLink>(box), now));
  return sources;
}

}  // namespace probebox::app
