#include <algorithm>
#include <array>
#include <vector>

#include "drivers/io/rendezvous.hpp"
#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/report.hpp"

namespace probebox::command {
namespace {

struct Found {
  std::string uri;
  messages::Descriptor descriptor;
  std::string clock;
};

// What is announced, and the usual address for a box that could not announce itself.
std::vector<std::string> candidates() {
  std::vector<std::string> all;
  const auto add = [&all](const std::string& uri) {
    if (std::ranges::find(all, uri) == all.end()) all.push_back(uri);
  };
  for (const auto& announcement : io::rendezvous::listed()) std::ranges::for_each(announcement.uris, add);
  add(kUsualUri);
  return all;
}

// Nothing for an address that does not answer: a killed box leaves its announcement behind.
std::optional<Found> asked(const std::string& text, milliseconds patience, const Console& console) {
  const auto uri = link::parseUri(text);
  if (!uri || uri->isFile()) return std::nullopt;
  const auto box = openBox(*uri, console, patience);
  if (!box) return std::nullopt;
  const auto status = (*box)->request<messages::Status>({}, patienceOf(console, patience));
  const std::string clock{status ? messages::nameOf(status->clock.state) : "unknown"};
  return Found{text, *(*box)->reader().descriptor(), clock};
}

Json describe(const Found& found) {
  return {{"uri", found.uri},
          {"board", found.descriptor.board},
          {"serial_number", found.descriptor.serial_number},
          {"machine", found.descriptor.machine},
          {"firmware_version", found.descriptor.firmware_version},
          {"clock_state", found.clock}};
}

using Cells = std::array<std::string, 6>;

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
    for (const auto& found : boxes) list.push_back(describe(found));
    console.object({{"boxes", list}});
  } else if (!boxes.empty()) {
    std::vector<Cells> rows{{"URI", "BOARD", "SERIAL NUMBER", "MACHINE", "FIRMWARE", "CLOCK"}};
    for (const auto& [uri, d, clock] : boxes) {
      rows.push_back({uri, d.board, d.serial_number, d.machine, d.firmware_version, clock});
    }
    showTable(rows, console);
  }
}

}  // namespace

ExitStatus run(const List& options, const std::string& given, Console& console) {
  const milliseconds patience{static_cast<std::int64_t>(std::max(1.0, std::min(options.timeout_s, 3600.0) * 1e3))};
  std::vector<Found> boxes;
  for (const auto& uri : given.empty() ? candidates() : std::vector{given}) {
    if (console.interrupted()) return ExitStatus::interrupted;
    console.progress("asking " + uri);
    if (auto found = asked(uri, patience, console)) boxes.push_back(std::move(*found));
  }
  show(boxes, console);
  if (!boxes.empty()) return ExitStatus::ok;
  console.note("probebox: no box answers; start an emulated one with `probeboxd --board sim`, or name one with -u URI");
  return ExitStatus::no_box;
}

}  // namespace probebox::command
