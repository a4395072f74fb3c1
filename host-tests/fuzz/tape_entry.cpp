#include "tape_entry.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>
#include <string>
#include <variant>

#include "firmware/tape/report.hpp"
#include "firmware/tape/session.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;

bool isPrintable(const std::string& text) {
  return !text.empty() && std::ranges::none_of(text, [](unsigned char c) { return std::iscntrl(c) != 0; });
}

void look(const Event& event) {
  if (const auto* marker = std::get_if<Marker>(&event)) {
    require(std::isfinite(marker->nominal_speed_mm_s) && marker->nominal_speed_mm_s >= 0);
    for (const double angle : marker->rotary_angles_rad) require(std::isfinite(angle));
  }
  if (const auto* homed = std::get_if<AxisHomed>(&event)) require(std::isfinite(homed->position_mm));
  if (const auto* pose = std::get_if<PoseTold>(&event)) {
    require(std::isfinite(pose->tool_length_mm));
    for (const double angle : pose->angles_rad) require(std::isfinite(angle));
  }
}

void look(const std::string& line) {
  const auto report = tape::understood(line);
  if (!report) return require(isPrintable(report.error().name) && isPrintable(report.error().what), line);
  if (const auto* said = std::get_if<tape::Said>(&*report)) {
    require(!said->empty());
    for (const auto& event : *said) look(event);
  }
  if (const auto* positions = std::get_if<tape::Positions>(&*report)) {
    for (const auto& at : positions->at_mm) require(!at || std::isfinite(*at));
  }
}

}  // namespace

int feedTape(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 2) return 0;
  tape::Session session{(data[0] & 1U) != 0, (data[0] & 2U) != 0};
  const std::size_t piece = 1 + data[1] % 64;
  for (auto rest = std::as_bytes(std::span{data + 2, size - 2}); !rest.empty();) {
    const auto taken = session.push(rest.first(std::min(piece, rest.size())), session.waits());
    require(taken > 0 && taken <= rest.size());
    rest = rest.subspan(taken);
    session.readerStarted();
    const auto line = session.line();
    if (!line) continue;
    require(line->text.size() <= tape::Session::kLongestLine);
    look(line->text);
    session.send("ok\r\n");
    if (!session.stopped()) session.sent(session.toSend().size());
  }
  return 0;
}
