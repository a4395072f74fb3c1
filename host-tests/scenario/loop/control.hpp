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

// The emulated machine with two more mounts of its plate.
world::Config worldOfTheLoop();
// That, or the emulated lathe for a machine of X and Z.
world::Config worldFor(const procedure::Facts& facts);

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
  enum class Is { move, arc, turn, turn_until_touched, tool, stop };
  Is is{};
  std::array<double, 3> to{};  // mm, or deg of A, B, C, or the number of the tool
  double feed{};               // mm/min, or deg/min; 0: rapid
  bool guarded{};
  std::array<double, 2> centre{};  // of an arc, from where it begins
  bool clockwise{};
};

// A control on an emulated machine with a box: what a program can command and read there. Virtual time.
class Control {
 public:
  // table: the axis that tilts the table, A or B; without one B swivels the head, and A orients the spindle.
  explicit Control(std::uint64_t seed, char table = 0, const procedure::Facts& facts = usualFacts());

  void wait(double s);
  void move(const std::array<double, 3>& to_mm, double feed_mm_min, bool guarded);
  void seek(const std::array<double, 3>& to_mm, double feed_mm_min);  // until the probe touches, which is no alarm
  void arc(const std::array<double, 2>& to_mm, const std::array<double, 2>& centre_mm, double feed_mm_min,
           bool clockwise);
  void turn(const std::array<double, 3>& to_deg, double feed_deg_min = 0);
  // Stops C where the probe touches, as soon as its drive can.
  void turnUntilTouched(double c_deg, double feed_deg_min);
  void takeTool(unsigned number);
  void orient() { ++orientations; }
  void endCoolant() { coolant = false; }
  void stop();
  double position(char axis);          // of the machine; angles as commanded
  double positionOfTheBox(char axis);  // the same by the letters of the box, as HAL wires them
  unsigned tool() const { return tool_; }

  Plc& plc() { return plc_; }
  RegisterLink& registers() { return registers_; }
  Boot& boot() { return boot_; }
  std::uint64_t crashes() { return office_.scenario().machine().crashes(); }
  const std::vector<Commanded>& commanded() const { return commanded_; }
  Scenario& scenario() { return office_.scenario(); }
  std::uint64_t contacts() { return office_.scenario().machine().stylus().contactCount(); }
  bool coolant{true};
  int orientations{};     // of the spindle
  double lowest_mm{1e9};  // of all moves since it was set
  // Of the tip, where the first probe's with the head level is at the position of the machine: during all turns and
  // after all tool changes since it was set.
  double lowest_tip_mm{1e9};
  std::function<void()> at_move;  // before each
  std::function<void()> at_wait;  // behind each dwell
  std::function<void()> at_stop;  // M0
  std::function<void()> at_tool;  // behind a change
  std::string said;               // message that the operator sees
  void mountBalls(std::size_t mount);
  // A tool of which the emulated machine knows nothing.
  void putIntoSpindle(unsigned number) { tool_ = number; }
  // Moves the machine, as a tool change does it: no program has commanded that.
  void shove(const std::array<double, 3>& to_mm);

 private:
  void run(Nanoseconds duration);
  void settle();
  bool slides(const world::Vector3& to_mm);
  world::Pose poseOf(const std::array<double, 3>& angles_deg) const;
  void watchTip(const std::array<double, 3>& from_deg, const std::array<double, 3>& to_deg);

  char table_;
  const world::Config world_;
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
