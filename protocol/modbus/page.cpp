#include "protocol/modbus/page.hpp"

#include <array>
#include <sstream>

#include "protocol/modbus/map.hpp"

namespace probebox::modbus {
namespace {

constexpr std::array<std::string_view, 6> kKindNames{"u16", "i16", "i16 + 32768", "u32", "i32", "f32"};

constexpr std::string_view kIntroduction =
    R"(# Modbus registers of the box
This page is made from the table in protocol/modbus/map.cpp and the list of live methods; `cmake --build build --target modbus-page` regenerates it.

Modbus RTU, 19200 8E1 and unit 1 unless configured otherwise. Functions 3 and 4 read the same map, 6 and 16 write the
registers marked `write`. Addresses count from 0, as on the wire. All registers of one read come from one instant. Addresses below
)";

constexpr std::string_view kRules = R"(
Rules for the master:
- The box only advises. It is not part of the path probe -> skip input -> motion stop, and no motion stop may depend on it.
- Use a correction only while status bit 0 is set and the heartbeat increases. If the box does not answer, it has no valid correction.
- Corrections are in machine axes, radius, to be added to the commanded position. They saturate at +-3.2767 mm with status bit 5
  set, and never wrap. When a source fails, its last value is held with bit 5 set; after the hold time bit 0 is cleared and the
  value stays frozen. It never jumps to 0.
- 32-bit values are high word first unless register 128 is 1, which the box keeps for the line.
- After any end of the box the first correction is the one that it served last, with bit 0 clear until all inputs are known.
- Registers 128 and 138 are stored before the write is answered, and restored before the first answer after any end. Markers,
  homings, poses and their commit registers begin at 0 again when the box starts or the line was unplugged.
- Exception 2 (illegal data address): an address outside the map, or a write to a register that is not marked `write`.
  Exception 3 (illegal data value): a value outside its range, or a write that service.toml does not allow. Exception 4 (device
  failure): a word order that cannot be stored. A refused write changes nothing, except an inhibit that cannot be stored: it
  holds until the box ends, and reads 1.
  Exception 1 (illegal function): every function but 3, 4, 6 and 16, also 43 (device identification).
- The box may hear itself: an RS-485 adapter whose receiver stays on while it sends is recognised by the first read. Until then an
  answer to function 6 that comes back may be answered once or twice again.
)";

void row(std::ostream& out, const Register& entry) {
  out << "| " << entry.address;
  if (registersOf(entry.kind) == 2) out << "-" << entry.address + 1;
  out << " | " << entry.name << " | " << kKindNames[static_cast<std::size_t>(entry.kind)] << " | ";
  if (!entry.unit.empty()) {
    if (entry.scale != 1) out << entry.scale << " ";
    out << entry.unit;
  }
  out << " | " << (entry.access == Access::write ? "write" : "read") << " | " << entry.meaning << " |\n";
}

}  // namespace

std::string referencePage(std::span<const MethodNumber> methods) {
  std::ostringstream out;
  out << kIntroduction << kRegisterCount
      << " that are not listed read 0 and are reserved for later versions. Map version " << kMapVersion << ".\n"
      << kRules << "\n| address | name | kind | one count is | access | meaning |\n|---|---|---|---|---|---|\n";
  for (const auto& entry : registers()) row(out, entry);
  out << "\nNumbers of methods in register " << address::calibration_method << ":\n\n| number | method |\n|---|---|\n";
  for (const auto& [number, name] : methods) out << "| " << number << " | " << name << " |\n";
  return out.str();
}

}  // namespace probebox::modbus
