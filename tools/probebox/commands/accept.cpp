#include "tools/probebox/commands/acceptance.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

ExitStatus run(const Accept& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  return acceptOn(**box, {options.id, signer(options.by, uri), options.although_it_differs}, console);
}

}  // namespace probebox::command
