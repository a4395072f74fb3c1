#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

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

Outcome<std::string, Trouble> pemText(const std::filesystem::path& path) {
  std::ifstream file{path, std::ios::binary};
  std::string text{std::istreambuf_iterator<char>{file}, {}};
  if (file.is_open() && !text.empty()) return text;
  return Trouble{ExitStatus::usage, "unreadable-input",
                 path.string() +
                     " cannot be read; probebox-keys box SERIAL makes a folder with box.crt, box.key and "
                     "people.crt"};
}

Outcome<messages::ProvisionKeys::Request, Trouble> keysIn(const std::filesystem::path& folder) {
  TRY(auto certificate, pemText(folder / "box.crt"));
  TRY(auto key, pemText(folder / "box.key"));
  TRY(auto people_ca, pemText(folder / "people.crt"));
  if (certificate.size() + key.size() + people_ca.size() > messages::ProvisionKeys::kMostBytes)
    return Trouble{ExitStatus::usage, "unreadable-input",
                   folder.string() + ": the keys have more than " +
                       std::to_string(messages::ProvisionKeys::kMostBytes) +
                       " bytes: take EC P-256, as probebox-keys does"};
  return messages::ProvisionKeys::Request{std::move(certificate), std::move(key), std::move(people_ca)};
}

// A file that is not to be written, or is good as it is.
ExitStatus tellChecked(const Provision& options, const board::Unit& unit, Console& console) {
  if (console.json())
    console.object({{"input", options.input}, {"serial_number", unit.serial_number}, {"good", true}});
  else
    console.line(options.input + " is good: " + unit.vendor + " " + unit.model + ", " + unit.serial_number +
                 (unit.sphere ? ", sphere " + unit.sphere->serial_number : ", no calibrated sphere"));
  return ExitStatus::ok;
}

// Keys can be sent again, the identity cannot: they come first.
ExitStatus sendKeys(link::Client& box, const messages::ProvisionKeys::Request& keys, Console& console) {
  const auto done = ask<messages::ProvisionKeys>(box, console, keys);
  if (!done) return console.fail(done.error());
  if (console.json())
    console.object({{"keys", true}});
  else
    console.line("The box has the keys, and uses them for its tls: links within a minute.");
  return ExitStatus::ok;
}

ExitStatus sendUnit(link::Client& box, const std::string& text, Console& console) {
  const auto done = ask<messages::Provision>(box, console, {.text = text});
  if (!done) return console.fail(done.error());
  if (console.json())
    console.object({{"serial_number", done->serial_number}, {"in_use", false}});
  else
    console.line("The box is " + done->serial_number +
                 " from its next start on: restart it (or probebox-usb.service and probeboxd.service).");
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const Provision& options, const std::string& uri, Console& console) {
  std::optional<std::string> text;
  if (!options.input.empty()) {
    auto read = unitText(options.input);
    if (!read) return console.fail(read.error());
    const auto unit = board::parseUnit(*read, options.input);
    if (!unit) return console.fail({ExitStatus::usage, "unreadable-input", unit.error().what});
    if (options.check) return tellChecked(options, *unit, console);
    text = std::move(*read);
  }
  std::optional<messages::ProvisionKeys::Request> keys;
  if (!options.keys.empty()) {
    auto read = keysIn(options.keys);
    if (!read) return console.fail(read.error());
    keys = std::move(*read);
  }
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  if (keys) {
    if (const auto status = sendKeys(**box, *keys, console); status != ExitStatus::ok) return status;
  }
  return text ? sendUnit(**box, *text, console) : ExitStatus::ok;
}

}  // namespace probebox::command
