#include "tools/gcode/loop/loop.hpp"

#include <memory>
#include <vector>

#include "tools/gcode/loop/fanuc.hpp"
#include "tools/gcode/loop/program_text.hpp"
#include "tools/gcode/loop/siemens.hpp"
#include "tools/gcode/loop/sources.hpp"

namespace probebox::gcode::loop {

Outcome<std::string> loopProgram(std::string_view dialect, const std::string& axes) {
  if (dialect == "haas")
    return Error{
        "A Haas cannot read registers: it is no Modbus master, and macros see nothing of its Ethernet. Let it print "
        "its markers instead: probebox gcode METHOD --dialect haas."};
  if (dialect == "linuxcnc")
    return Error{
        "The loop program of LinuxCNC is a kit of its own: copy /usr/share/probebox/linuxcnc "
        "(tools/linuxcnc/README.md)."};
  std::vector<Subprogram> all;
  for (const auto source : kSources) {
    TRY(auto some, subprogramsOf(source));
    for (auto& one : some) all.push_back(std::move(one));
  }
  all.push_back({"look", {}});
  const auto writer = dialect == "siemens" ? siemensWriter({axes}) : fanucWriter({axes});
  return writer->write(all);
}

}  // namespace probebox::gcode::loop
