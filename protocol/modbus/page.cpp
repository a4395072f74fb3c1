#include "protocol/modbus/page.hpp"

#include <array>
#include <sstream>

#include "protocol/modbus/map.hpp"
#include "protocol/modbus/refusals.hpp"

namespace probebox::modbus {
namespace {

constexpr std::array<std::string_view, 6> kKindNames{"u16", "i16", "i16 + 32768", "u32", "i32", "f32"};

constexpr std::string_view kIntroduction =
    R"(# Modbus registers of the box
This page is made from the tables in protocol/modbus and the list of live methods; `cmake --build build --target modbus-page` regenerates it,
and [map.json](map.json), which has the same for programs, and the pins of a HAL component.

Modbus RTU, 19200 8E1 and unit 1 unless configured otherwise, or Modbus TCP at an address of service.toml, whatever unit is named.
Functions 3 and 4 read the same map, 6 and 16 write the registers marked `write`. Addresses count from 0, as on the wire. All registers
of one read come from one instant. Addresses below
)";

constexpr std::string_view kRules = R"(
Rules for the master:
- The box only advises. It is not part of the path probe -> skip input -> motion stop, and no motion stop may depend on it.
- Use a correction only while status bit 0 is set and the heartbeat increases. If the box does not answer, it has no valid correction.
- Corrections are in machine axes, radius, to be added to the commanded position. They saturate at +-3.2767 mm with status bit 5
  set, and never wrap. When a source fails, its last value is held with bit 5 set; after the hold time bit 0 is cleared and the
  value stays frozen. It never jumps to 0.
- The box starts with bit 0 clear and its last value, and register 50 counts its starts. Corrections need neither the probe nor the master
  clock, which are silent in many a cut, but the encoders, references, sensors and results of what is summed (register 12).
- 32-bit values are high word first unless register 128 is 1, which the box keeps for the line. By TCP the address decides (`words=`), for
  all masters, and register 128 takes no other value.
- After any end of the box the first correction is the one that it served last, with bit 0 clear until all inputs are known.
- A master that did not read for a while is taken on from the correction that it read last, at the limit of rate.
  Register 48 is 0 meanwhile, and register 3 counts on. Read at least once a second, so that the correction keeps up. A master that holds an offset
  over a power cut of the box limits the rate itself when it goes on.
- Registers 128 and 138 are stored before the write is answered, and restored before the first answer after any end. Markers,
  homings, poses, requests and their commit registers begin at 0 again when the box starts or the serial line was unplugged; references of axes
  that are not absolute, the tool and angles that the controller sent are lost with a start of the box, and so is the mask, which
  begins as machine.toml has it.
- Tables by tool number have 99 rows of 16 registers; the address of row N is that of row 1, which is listed, plus 16 (N - 1). One request
  reads up to 125 registers: seven rows.
- A request to unit 0 (broadcast) is done by every unit and answered by none. By TCP it is a request like any other.
- By TCP 8 masters are served at once; one more takes the place of one that has asked for nothing yet, or else of the one that has been
  silent for longest, of those of the computer that has most; a computer that has half of all replaces its own. All share the registers that they write, so one alone should: then a request that is repeated over a new
  connection is done once. What is no Modbus over TCP ends the connection.
- A frame begins after silence or behind a whole frame. What is inside another unit's answer, or inside a frame with a bad CRC, is not done
  unless the line falls silent for 50 ms in its middle: after such a silence the box listens for a new frame. Noise before or behind a
  request does not hide it: where the line pauses (t3.5) behind a whole request, a read is answered whatever stands before it, such as a
  write that was torn off, and a write behind up to three bytes.
- Exception 2 (illegal data address): an address outside the map, or a write to a register that is not marked `write`.
  Exception 3 (illegal data value): a value outside its range, or a write that service.toml does not allow; both at once where the write
  has both words of a value. A line that may do nothing writes register 128 alone. A write to a commit register answers so for all that it commits: a homing outside of the travel, of
  an axis that moves or tells its position itself, a marker that belongs to no step, a pose without values. Exception 4 (device
  failure): a word order that cannot be stored. A refused write changes nothing, except an inhibit that cannot be stored: it
  holds until the box ends, and reads 1. The same write again tries again, and has exception 3 until it is stored.
  Exception 1 (illegal function): every function but 3, 4, 6, 16 and 43 with type 14 (device identification: vendor, product, revision).
- The box may hear itself: an RS-485 adapter whose receiver stays on while it sends is recognised by the first read. Until then, and
  from an echo that came late or damaged until the next read, an answer to function 6 that comes back may be answered once or twice again.

A calibration by registers alone (service.toml must allow it: allow_calibrate, allow_marker, for the last step allow_accept):
1. Write method and options (800 to 821, 830), then run or result, request and commit (834 to 837). Wait until 838 is the commit number: 839 is 2
   (done; 842 has the run) or 3 (refused; 840 says why: 4 and 7 may pass, 6 does not). What service.toml does not allow is no
   refusal of 840, but exception 3 to the write of 837. While 839 is 1, or no answer came, the same write again is safe.
2. Read 848 to 939 in one request. 848 = 1: a step is to be done; take tool, angles and the start of the approach (target plus clearance
   against the way in), stand still.
   A is the orientation of the spindle that holds the probe (M19 R, SPOS), not a rotary axis A of the machine. B is the table that tilts
   or the head that swivels, whatever the control calls it (ISO 841: A where it turns about X). C is the axis that turns along Z.
3. Write the begin marker: run, step, phase 0, speed, tool, angles, at rest 1, commit (144 to 157). Exception 3: read 848 to 939 again.
   The box does not compare the speed of the marker with that of register 882: see to it that no override changes it.
4. Move as 852 says: in by clearance plus overtravel, dwell where it is a touch, out by overtravel, clearance and run-out at that speed. Stand
   still for 0.2 s, then write the end marker (phase 1, another commit number).
   A scan is marked in contact: come onto the surface along the normal to the first radius before the begin marker, follow arcs and
   ramps with an exact stop after each, write the end marker, and withdraw along the normal of where it ended.
   A turn (7) moves C alone, as 934 to 939 say.
   A dry run comes before the first begin marker: go the way of each step in the air and write a marker of phase 3 (pass) in place of both; the
   box then asks for the next step, and behind the last one for the first step again. A begin marker on the way is refused.
5. When 849 has risen, go to 2. When it has not after 1 s, or 859 has risen, the step is repeated: 860 says why. 848 = 2 without a motion of
   yours: a master before this one died in mid-step; write phase 2 (abandon), then go to 2.
6. 848 = 3: the box solves. 4: register 102 has the number of the result; accept it by request 3. 5: refused, register 104 says why.
A master that dies at any point leaves nothing half done: the step is given up 60 s after the time that it may take (1.5 times a travel or a rest, 3 times a turn of C) and asked for again, the run waits, and request 2
(abort) ends it. Runs are counted from 1 at each start of the box: a master that sees register 50 change begins anew. Corrections follow when register 839 is 2 after the accept, unless 844 says that a cut is on.
)";

void row(std::ostream& out, const Register& entry) {
  out << "| " << entry.address;
  if (registersOf(entry.kind) == 2) out << "-" << entry.address + 1;
  if (entry.rows > 1) out << ", ...";
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
  out << "\nCodes of refusals in registers " << address::calibration_refusal << ", " << address::request_refusal
      << " and " << address::step_fault << "; those from " << refusal::of_solver
      << " on are the names that docs/metrology.md explains:\n\n| code | refusal |\n|---|---|\n";
  for (const auto& [code, text] : refusalCodes()) out << "| " << code << " | " << text << " |\n";
  return out.str();
}

}  // namespace probebox::modbus
