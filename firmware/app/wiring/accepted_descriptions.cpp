// Loads the descriptions and checks whether the daemon can run with them.
#include <algorithm>

#include "firmware/app/host/key_folder.hpp"
#include "firmware/app/host/tls_door.hpp"
#include "firmware/app/wiring/addresses.hpp"
#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/box_config.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "firmware/box/box.hpp"
#include "firmware/metrology/dataset/subject.hpp"

namespace probebox::app {
namespace {

std::optional<Error> whyUnknownSubject(const board::Machine& machine) {
  for (const auto& requirement : machine.requirements) {
    if (!parseSubject(requirement.subject))
      return Error{"machine.toml: [[requirement]] subject = \"" + requirement.subject +
                   "\" is none that results are about: write it as `probebox results` does, such as \"delay\", "
                   "\"centreline\" or \"tool-4\"."};
  }
  return std::nullopt;
}

}  // namespace

Outcome<board::Descriptions> loadDescriptions(const Options& options) {
  if (options.board == "sim") return board::simDescriptions(options.config);
  if (options.board == "sim-lathe") return board::simLatheDescriptions(options.config);
  return board::loadDirectory(options.board, options.config);
}

std::optional<Error> validate(const Options& options, const board::Descriptions& descriptions) {
  std::optional<Error> refused;
  const auto add = [&](const std::optional<Error>& error) {
    if (error) refused = Error{refused ? refused->what + "\n" + error->what : error->what};
  };
  add(whyUnsupported(descriptions));
  add(box::validate(boxConfig(descriptions)));
  add(whyNoAddresses(options, descriptions.service));
  add(whyUnknownSubject(descriptions.machine));
  if (options.time_scale != 1.0 && !isEmulated(descriptions))
    add(Error{"--time-scale is for the emulated machine only: real edges are stamped in real time."});
  if (options.time_scale != 1.0 && descriptions.world && descriptions.world->outside_control)
    add(
        Error{"--time-scale is not for a machine that an outside control leads, which is in real time: remove it, or "
              "[outside_control] of world.toml."});
  return refused;
}

std::optional<Error> whyNoDoor(const Options& options, const board::Descriptions& descriptions) {
  const auto& service = descriptions.service;
  const bool is_wanted =
      std::ranges::any_of(linksOf(options, service), [](const std::string& link) { return link.starts_with("tls:"); });
  return is_wanted && service.tls ? whyNoKeys(KeyFolder{stateDirectory(options.state)}.in(*service.tls)) : std::nullopt;
}

}  // namespace probebox::app
