#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

// Reads a program back as a control would, knowing nothing of how it was written, and finds what a machinist would not
// let run.
namespace probebox {

struct Reached {
  std::array<double, 3> at_mm{};
  std::array<double, 3> angles_deg{};  // A: of the spindle
  double feed_mm_min{};
  bool placed{};                      // X and Y are known
  bool guarded{};                     // the skip input ends it, and an alarm follows
  bool at_machine_height{};           // X and Y alone, with Z retracted
  int arc{};                          // 2 clockwise, 3 the other way, 0: straight
  std::array<double, 2> centre_mm{};  // of an arc
};

// Rotary axes alone; the spindle's orientation is none.
struct Turned {
  std::array<double, 3> angles_deg{};
  std::size_t after{};  // how many moves came before it
  double at_z_mm{};
  bool tip_control{};
};

// A line that goes to the box: begin or end of a step.
struct SentMark {
  bool begin{};
  std::size_t step{};
  std::array<double, 3> angles_deg{};
  double speed_mm_s{};
  std::size_t after{};  // how many moves came before it
};

inline constexpr double kSought_mm = 0.5;  // beyond the place of a surface

// What lies between two stops for the operator, the first before any motion.
struct Part {
  std::vector<Reached> moves;
  std::vector<Turned> turns;
  std::vector<SentMark> marks;
  std::vector<std::size_t> dwells, retracts, tools;  // after how many moves
  std::size_t seeks{};                               // for a surface, which are no moves of the path
};

struct Interpreted {
  std::vector<Part> parts{1};
  std::vector<std::string> unknown;   // lines that no control of that kind would take
  std::vector<std::string> dangers;   // with the line
  std::vector<std::string> messages;  // that the operator sees at stops
  int orientations{};                 // of the spindle
  bool ended{};
};

// Lathes of X and Z, with a turret: system A of a Fanuc, X in diameters, or a Siemens, X in radius after DIAMOF.
enum class Machine { mill, system_a, siemens_lathe };
Interpreted interpret(const std::string& program, Machine machine = Machine::mill);

}  // namespace probebox
