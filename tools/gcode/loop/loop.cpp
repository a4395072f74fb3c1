#include "tools/gcode/loop/loop.hpp"

#include <memory>
#include <vector>

#include "tools/gcode/loop/fanuc.hpp"
#include "tools/gcode/loop/program_text.hpp"
#include "tools/gcode/loop/siemens.hpp"
#include "tools/gcode/loop/sources.hpp"

namespace probebox::gcode::loop {

Outcome<std::string> loopProgram(std::string_view dialect, const std::string& axes, int number, int frame) {
  if (dialect == "haas")
    return Error{
        "A Haas cannot read registers: it is no Modbus master, and macros see nothing of its Ethernet. Let it print "
        "its markers instead: probebox gcode METHOD --dialect haas."};
  if (dialect == "linuxcnc")
    return Error{
        "The loop program of LinuxCNC is a kit of its own: copy /usr/share/probebox/linuxcnc "
        "(tools/linuxcnc/README.md)."};
  if (dialect != "fanuc" && number != kFirstProgram)
    return Error{"--number is for fanuc and haas: others name programs."};
  if (dialect != "fanuc" && frame != kFrame)
    return Error{"--frame is for fanuc: " + std::string{dialect} + " moves without a work offset."};
  if (number < 1 || number > kLastFirstProgram)
    return Error{"--number with --loop is from 1 to " + std::to_string(kLastFirstProgram) +
                 ": the program takes 50 numbers, and those from 9000 on belong to the builder."};
  std::vector<Subprogram> all;
  for (const auto source : sources()) {
    TRY(auto some, subprogramsOf(source));
    for (auto& one : some) all.push_back(std::move(one));
  }
  all.push_back({"look", {}});
  const auto writer = dialect == "siemens" ? siemensWriter({axes}) : fanucWriter({axes}, number, frame);
  return writer->write(all);
}

}  // namespace probebox::gcode::loop
