#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "board/describe/parse.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report_unit.hpp"

namespace probebox::command {
namespace {

// One byte more than a box takes shows that a file is too long.
Outcome<std::string, Trouble> unitText(const std::string& path) {
  const auto unreadable = [&](const std::string& why) {
    return Trouble{ExitStatus::usage, "unreadable-input", path + ": " + why};
  };
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown))
    return unreadable("there is no such file; docs/vendor.md shows a unit.toml");
  std::ifstream file{path, std::ios::binary};
  std::string text(messages::Provision::kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || !file.is_open()) return unreadable(std::string{"it cannot be read ("} + std::strerror(errno) + ")");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() <= messages::Provision::kMostBytes) return text;
  return unreadable("it has more than " + std::to_string(messages::Provision::kMostBytes) + " bytes: shorten it");
}

}  // namespace

ExitStatus run(const Provision& options, const std::string& uri, Console& console) {
  const auto text = unitText(options.input);
  if (!text) return console.fail(text.error());
  const auto unit = board::parseUnit(*text, options.input);
  if (!unit) return console.fail({ExitStatus::usage, "unreadable-input", unit.error().what});
  if (options.check) {
    if (console.json())
      console.object({{"input", options.input}, {"serial_number", unit->serial_number}, {"good", true}});
    else
      console.line(options.input + " is good: " + unit->vendor + " " + unit->model + ", " + unit->serial_number +
                   (unit->sphere ? ", sphere " + unit->sphere->serial_number : ", no calibrated sphere"));
    return ExitStatus::ok;
  }
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto done = ask<messages::Provision>(**box, console, {.text = *text});
  if (!done) return console.fail(done.error());
  if (console.json())
    console.object({{"serial_number", done->serial_number}, {"in_use", false}});
  else
    console.line("The box is " + done->serial_number +
                 " from its next start on: restart it (or probebox-usb.service and probeboxd.service).");
  return ExitStatus::ok;
}

}  // namespace probebox::command
