#pragma once
#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "firmware/app/cnc/cnc_interface.hpp"
#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/cnc/modbus_tcp_server.hpp"
#include "firmware/app/cnc/text_server.hpp"

namespace probebox::app {

using CncOptions = std::variant<ModbusOptions, ModbusTcpOptions, TextOptions>;

// "modbus:DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,unit=1]", "modbus-tcp:HOST:PORT[,words=low-first]", or
// as parseTextOptions().
Outcome<CncOptions> parseCncLine(const std::string& text);
// The serial line of an interface, or null: it is on the network.
const serial::Address* serialLineOf(const CncOptions& options);

// Opens a listener, or finds the one that somebody has opened for the box.
using Listen = std::function<Outcome<tcp::Listener>(const tcp::Address&)>;

// may: rights of the controller. A serial line that is not there yet is opened when it comes; a listener that cannot be
// had is an error.
Outcome<std::unique_ptr<CncInterface>> openCncInterface(const CncOptions& options, const board::Access& may,
                                                        StateBuffer& states, const CncDependencies& dependencies,
                                                        const Listen& listen);

}  // namespace probebox::app
