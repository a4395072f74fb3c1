#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {

ExitStatus run(const Accept& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto accepted = ask<messages::AcceptResult>(**box, console, {options.id, options.by});
  if (!accepted) return console.fail(accepted.error());
  tellAccepted(options.id, options.by, *accepted, console);
  return ExitStatus::ok;
}

}  // namespace probebox::command
