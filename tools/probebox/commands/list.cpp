#include <algorithm>
#include <array>
#include <vector>

#include "drivers/io/rendezvous.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/on_usb.hpp"
#include "tools/probebox/link/plug_watch.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// One line of the answer. A box on USB is there even when it cannot be asked.
struct Found {
  std::string uri;
  messages::Descriptor descriptor;
  std::string clock;
  std::string state;
  std::string obstacle;  // why it was not asked, and what to do
};

// Announced addresses, and the usual one for a box that could not announce itself.
std::vector<std::string> candidates() {
  std::vector<std::string> all;
  const auto add = [&all](const std::string& uri) {
    if (std::ranges::find(all, uri) == all.end()) all.push_back(uri);
  };
  for (const auto& announcement : io::rendezvous::listed()) std::ranges::for_each(announcement.uris, add);
  if (!io::rendezvous::chosen()) add(kUsualUri);
  return all;
}

Outcome<Found, Trouble> asked(const link::Uri& uri, milliseconds patience, const Console& console) {
  TRY(const auto box, openBox(uri, console, patience));
  const auto status = box->request<messages::Status>({}, patienceOf(console, patience));
  const std::string clock{status ? messages::nameOf(status->clock.state) : "unknown"};
  return Found{uri.text, box->described(), clock, "free", {}};
}

// Nothing for an address that does not answer: a killed box leaves its announcement behind.
std::optional<Found> asked(const std::string& text, milliseconds patience, const Console& console) {
  const auto uri = link::parseUri(text);
  if (!uri || uri->isFile()) return std::nullopt;
  auto found = asked(*uri, patience, console);
  return found ? std::optional{std::move(*found)} : std::nullopt;
}

// Facts about a box: its own answer, else what its USB descriptors show.
Found lookedAt(const usb_host::Device& device, milliseconds patience, const Console& console) {
  const std::string uri = "usb:" + device.name();
  const auto state = stateOf(device);
  if (state.access == usb_host::Access::free) {
    if (auto found = asked(uri, patience, console)) return *found;
  }
  messages::Descriptor seen;
  seen.serial_number = device.serial_number;
  seen.board = device.product;
  const std::string name{state.access == usb_host::Access::free ? "silent" : usb_host::nameOf(state.access)};
  const std::string obstacle =
      state.why.empty() ? "does not answer; is probeboxd running on it?" : state.why + "; " + state.remedy;
  return {uri, seen, {}, name, obstacle};
}

Json describeFound(const Found& found) {
  Json json{{"uri", found.uri},
            {"board", found.descriptor.board},
            {"serial_number", found.descriptor.serial_number},
            {"machine", found.descriptor.machine},
            {"firmware_version", found.descriptor.firmware_version},
            {"clock_state", found.clock},
            {"state", found.state}};
  if (!found.obstacle.empty()) json["what"] = found.obstacle;
  return json;
}

using Cells = std::array<std::string, 7>;

// Columns as wide as their widest cell.
void showTable(const std::vector<Cells>& rows, Console& console) {
  for (const auto& row : rows) {
    std::string text;
    for (std::size_t column = 0; column < row.size(); ++column) {
      const auto size = [column](const Cells& cells) { return cells[column].size(); };
      const auto width = size(std::ranges::max(rows, {}, size));
      text += row[column] + (column + 1 < row.size() ? std::string(width - row[column].size() + 2, ' ') : "");
    }
    console.line(text);
  }
}

void show(const std::vector<Found>& boxes, Console& console) {
  if (console.json()) {
    Json list = Json::array();
    for (const auto& found : boxes) list.push_back(describeFound(found));
    console.object({{"boxes", list}});
  } else if (!boxes.empty()) {
    std::vector<Cells> rows{{"URI", "BOARD", "SERIAL NUMBER", "MACHINE", "FIRMWARE", "CLOCK", "STATE"}};
    for (const auto& [uri, d, clock, state, obstacle] : boxes) {
      rows.push_back({uri, d.board, d.serial_number, d.machine, d.firmware_version, clock, state});
    }
    showTable(rows, console);
  }
  for (const auto& found : boxes) {
    if (!found.obstacle.empty()) console.note("probebox: " + found.uri + ": " + found.obstacle);
  }
}

// Everything that can be found without being told where to look.
std::vector<Found> search(milliseconds patience, Console& console) {
  std::vector<Found> boxes;
  for (const auto& uri : candidates()) {
    if (console.interrupted()) return boxes;
    console.progress("asking " + uri);
    if (auto found = asked(uri, patience, console)) boxes.push_back(std::move(*found));
  }
  for (const auto& device : boxesOnUsb()) {
    if (console.interrupted()) return boxes;
    console.progress("asking usb:" + device.name());
    if (std::ranges::find(boxes, "usb:" + device.name(), &Found::uri) != boxes.end()) continue;
    boxes.push_back(lookedAt(device, patience, console));
  }
  return boxes;
}

ExitStatus listOne(const std::string& given, milliseconds patience, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (uri->isFile()) return console.fail(usage(uri->text + " is a recording; see `probebox info`, or name a box"));
  const auto found = asked(*uri, patience, console);
  if (!found) return console.fail(found.error());
  show({*found}, console);
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const List& options, const std::string& given, Console& console) {
  if (options.watch) return watchPlugs(options.until, console);
  const auto patience = inMilliseconds(options.timeout_s);
  if (!given.empty()) return listOne(given, patience, console);
  const auto boxes = search(patience, console);
  if (console.interrupted()) return ExitStatus::interrupted;
  show(boxes, console);
  if (!boxes.empty()) return ExitStatus::ok;
  console.note(
      "probebox: no box answers; plug one in, start an emulated one with `probeboxd --board sim`, or name one with -u "
      "URI");
  return ExitStatus::no_box;
}

}  // namespace probebox::command
