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
  constexpr std::string_view kModbus = "modbus:", kModbusTcp = "modbus-tcp:";
  if (text.starts_with(kModbusTcp)) {
    TRY(auto options, parseModbusTcpOptions(std::string_view{text}.substr(kModbusTcp.size())));
    return CncOptions{std::move(options)};
  }
  if (!text.starts_with(kModbus))
    return Error{"The CNC line '" + text +
                 "' is not modbus:DEVICE[,baud=19200][,parity=even][,unit=1], modbus-tcp:HOST:PORT[,words=low-first], "
                 "records:DEVICE[,every=100] or tape:DEVICE[,dialect=g10]."};
  TRY(auto options, parseModbusOptions(std::string_view{text}.substr(kModbus.size())));
  return CncOptions{std::move(options)};
}

const serial::Address* serialLineOf(const CncOptions& options) {
  if (const auto* modbus = std::get_if<ModbusOptions>(&options)) return &modbus->line;
  if (const auto* text = std::get_if<TextOptions>(&options)) return &text->line;
  return nullptr;
}

Outcome<std::unique_ptr<CncFace>> openCncFace(const CncOptions& options, const board::Access& may, StateBuffer& states,
                                              const CncColleagues& colleagues, const Listen& listen) {
  if (const auto* text = std::get_if<TextOptions>(&options))
    return std::unique_ptr<CncFace>{std::make_unique<TextLine>(*text, may, states, colleagues)};
  if (const auto* line = std::get_if<ModbusOptions>(&options)) {
    auto modbus = *line;
    modbus.revision = colleagues.revision;
    const CncLine::Way way{
        .kind = "modbus", .name = modbus.line.path, .may = may, .serve = [&modbus](RegisterServer::Faces faces) {
          return std::make_unique<ModbusServer>(modbus, std::move(faces));
        }};
    return std::unique_ptr<CncFace>{std::make_unique<CncLine>(way, states, colleagues)};
  }
  const auto& [address, words] = std::get<ModbusTcpOptions>(options);
  TRY(auto listener, listen(address));
  const CncLine::Way way{.kind = "modbus-tcp",
                         .name = tcp::describe(listener.address()),
                         .may = may,
                         .words = words,
                         .serve = [&](RegisterServer::Faces faces) {
                           return std::make_unique<ModbusTcpServer>(std::move(listener), colleagues.revision,
                                                                    std::move(faces));
                         }};
  return std::unique_ptr<CncFace>{std::make_unique<CncLine>(way, states, colleagues)};
}

}  // namespace probebox::app
