#pragma once
#include <array>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "host-tests/emulation/line_of_the_box.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "plc.hpp"

namespace probebox::scenario {

// The program stopped with this text.
struct Alarm : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A guarded move has met something: the control has stopped it.
struct Touched : Alarm {
  Touched() : Alarm{"the probe touched on the way"} {}
};

// What a program has commanded.
struct Commanded {
  enum class Is { move, turn, tool, stop };
  Is is{};
  std::array<double, 3> to{};  // mm, or deg of A, B, C, or the number of the tool
  double feed_mm_min{};
  bool guarded{};
};

// A control on an emulated machine with a box: what a program can command and read there. Virtual time.
class Control {
 public:
  explicit Control(std::uint64_t seed);

  void wait(double s);
  void move(const std::array<double, 3>& to_mm, double feed_mm_min, bool guarded);
  void turn(const std::array<double, 3>& to_deg);
  void takeTool(unsigned number);
  void stop();
  double position(char axis);  // of the machine; angles as commanded
  unsigned tool() const { return tool_; }

  Plc& plc() { return plc_; }
  RegisterLink& registers() { return registers_; }
  Boot& boot() { return boot_; }
  std::uint64_t crashes() { return office_.scenario().machine().crashes(); }
  const std::vector<Commanded>& commanded() const { return commanded_; }
  std::uint64_t contacts() { return office_.scenario().machine().stylus().contactCount(); }
  double lowest_mm{1e9};          // of all moves since it was set
  std::function<void()> at_move;  // before each
  std::function<void()> at_stop;  // M0
  std::function<void()> at_tool;  // behind a change
  // A tool of which the emulated machine knows nothing.
  void putIntoSpindle(unsigned number) { tool_ = number; }
  // Moves the machine, as a tool change does it: no program has commanded that.
  void shove(const std::array<double, 3>& to_mm);

 private:
  void run(Nanoseconds duration);
  void settle();

  const support::TemporaryFolder folder_;
  Office office_;
  Boot boot_;
  LineOfTheBox line_{office_, boot_};
  RegisterLink registers_{line_.registers()};
  Plc plc_{line_.registers()};
  std::array<double, 3> angles_deg_{};
  unsigned tool_{1};
  std::vector<Commanded> commanded_;
  Nanoseconds since_plc_{}, since_worker_{};
};

}  // namespace probebox::scenario
