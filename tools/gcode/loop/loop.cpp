#include "tools/gcode/loop/loop.hpp"

#include <algorithm>
#include <memory>
#include <vector>

#include "tools/gcode/loop/fanuc.hpp"
#include "tools/gcode/loop/program_text.hpp"
#include "tools/gcode/loop/siemens.hpp"
#include "tools/gcode/loop/sources.hpp"

namespace probebox::gcode::loop {
namespace {

constexpr std::string_view kOfLathes = "-lathe";
constexpr int kFrame = 48;

// A lathe has X and Z, in the order of the control; other machines begin with X, Y, Z.
std::optional<Error> whyOtherAxes(const Axes& axes) {
  std::string rest = axes.letters;
  std::ranges::sort(rest);
  const bool once = std::ranges::adjacent_find(rest) == rest.end();
  const auto has = [&](char axis) { return rest.find(axis) != std::string::npos; };
  const bool linear = axes.lathe ? has('X') && has('Z') : axes.letters.starts_with("XYZ");
  if (once && linear && rest.find_first_not_of("ABCXYZ") == std::string::npos) return std::nullopt;
  return Error{axes.lathe ? "--axes of a lathe are X and Z, and those of Y and C that the control has, as it numbers "
                            "them, such as XZC or XZCY."
                          : "--axes are XYZ, then those of A, B and C that the control has, such as XYZBC."};
}

}  // namespace

Outcome<std::string> loopProgram(std::string_view dialect, const std::string& letters, int number,
                                 std::optional<int> frame) {
  if (dialect == "haas")
    return Error{
        "A Haas cannot read registers: it is no Modbus master, and macros see nothing of its Ethernet. Let it print "
        "its markers instead: probebox gcode METHOD --dialect haas."};
  if (dialect == "linuxcnc")
    return Error{
        "The loop program of LinuxCNC is a kit of its own: copy /usr/share/probebox/linuxcnc "
        "(tools/linuxcnc/README.md)."};
  const bool fanuc = dialect.starts_with("fanuc");
  Axes axes{.letters = letters, .lathe = dialect.ends_with(kOfLathes)};
  if (letters.empty()) axes.letters = axes.lathe ? "XZC" : Axes{}.letters;
  if (auto error = whyOtherAxes(axes)) return *error;
  if (!fanuc && number != kFirstProgram) return Error{"--number is for fanuc and haas: others name programs."};
  if (!fanuc && frame) return Error{"--frame is for fanuc: " + std::string{dialect} + " moves without a work offset."};
  if (number < 1 || number > kLastFirstProgram)
    return Error{"--number with --loop is from 1 to " + std::to_string(kLastFirstProgram) +
                 ": the program takes 50 numbers, and those from 9000 on belong to the builder."};
  std::vector<Subprogram> all;
  for (const auto source : sources()) {
    TRY(auto some, subprogramsOf(source));
    for (auto& one : some) all.push_back(std::move(one));
  }
  all.push_back({"look", {}});
  const auto writer = fanuc ? fanucWriter(axes, number, frame.value_or(axes.lathe ? 0 : kFrame)) : siemensWriter(axes);
  return writer->write(all);
}

}  // namespace probebox::gcode::loop
