#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/report.hpp"

namespace probebox::command {

ExitStatus run(const Status&, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto status = ask<messages::Status>(**box, console);
  if (!status) return console.fail(status.error());
  if (console.json()) {
    console.object(describe(*status));
  } else {
    console.line(page(*status));
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
