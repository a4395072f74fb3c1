#include "firmware/app/cnc/open_cnc_face.hpp"

#include <string_view>
#include <utility>

#include "firmware/app/cnc/cnc_lines.hpp"
#include "firmware/app/cnc/text_line.hpp"

namespace probebox::app {

Outcome<CncOptions> parseCncLine(const std::string& text) {
  if (auto face = parseTextOptions(text)) {
    if (!face->ok()) return face->error();
    return CncOptions{std::move(*face).value()};
  }
  constexpr std::string_view kModbus = "modbus:";
  if (!std::string_view{text}.starts_with(kModbus))
    return Error{"The CNC line '" + text +
                 "' is not modbus:DEVICE[,baud=19200][,parity=even][,unit=1], records:DEVICE[,every=100] or "
                 "tape:DEVICE[,dialect=g10]."};
  TRY(auto options, parseModbusOptions(std::string_view{text}.substr(kModbus.size())));
  return CncOptions{std::move(options)};
}

const serial::Address& addressOf(const CncOptions& options) {
  return std::visit([](const auto& of_face) -> const serial::Address& { return of_face.line; }, options);
}

std::unique_ptr<CncFace> openCncFace(const CncOptions& options, const board::Access& may, StateBuffer& states,
                                     const CncColleagues& colleagues) {
  if (const auto* text = std::get_if<TextOptions>(&options))
    return std::make_unique<TextLine>(*text, may, states, colleagues);
  auto modbus = std::get<ModbusOptions>(options);
  modbus.revision = colleagues.revision;
  return std::make_unique<CncLine>(modbus, may, states, colleagues);
}

}  // namespace probebox::app
