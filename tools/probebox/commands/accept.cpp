#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"

namespace probebox::command {

ExitStatus run(const Accept& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto accepted = ask<messages::AcceptResult>(**box, console, {options.id, options.by});
  if (!accepted) return console.fail(accepted.error());
  if (console.json()) {
    console.object({{"accepted_id", options.id}, {"accepted_by", options.by}});
  } else {
    console.line("result " + std::to_string(options.id) + " is in force, accepted by " + options.by);
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
