#pragma once
#include <memory>
#include <string>
#include <variant>

#include "firmware/app/cnc/cnc_face.hpp"
#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/cnc/text_server.hpp"

namespace probebox::app {

using CncOptions = std::variant<ModbusOptions, TextOptions>;

// "modbus:DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,unit=1]", or as parseTextOptions().
Outcome<CncOptions> parseCncLine(const std::string& text);
const serial::Address& addressOf(const CncOptions& options);

// may: rights of the controller.
std::unique_ptr<CncFace> openCncFace(const CncOptions& options, const board::Access& may, StateBuffer& states,
                                     const CncColleagues& colleagues);

}  // namespace probebox::app
