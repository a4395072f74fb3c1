#pragma once
#include <cmath>
#include <gmock/gmock.h>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "kit.hpp"
#include "text_program.hpp"
#include "tools/gcode/loop/loop.hpp"

// Runs of the loop program, by the kit itself and by the texts that are made from it.
namespace probebox::scenario {

namespace address = modbus::address;

inline constexpr double kSafeZ_mm = -100;  // as probebox_places.ngc has it, for tools that are no longer than the probe
// Values of probebox_run.
enum Came { kDone = 0, kBeyond = 2, kRefused = 3, kNotAccepted = 4, kSilent = 6 };

struct Asked {
  double method{}, axis{}, tool{};
  Came came{kDone};
  double read_by{}, mounts{}, contacts{};

  std::vector<double> asked() const { return {method, axis, tool, read_by, mounts, contacts}; }
};

// One control, one machine, one box. table: the axis of the control that tilts the table.
class Session {
 public:
  explicit Session(double dry, char table = 0, const procedure::Facts& facts = usualFacts())
      : control{1, table, facts}, dry_{dry}, table_{table} {}
  virtual ~Session() = default;
  // The value of probebox_run.
  virtual double run(const Asked& run) = 0;
  std::string why() {
    auto& box = control.registers();
    std::ostringstream text;
    text << "refusal of the run " << box.value(address::calibration_refusal) << ", of the controller_request "
         << box.value(address::request_refusal) << ", state " << box.value(address::step_state) << ", step "
         << box.value(address::step_number) << ", fault " << box.value(address::step_fault);
    return text.str();
  }
  // A person turns the plate as the control's message says, and counts what that was.
  void standByThePlate() {
    control.at_stop = [this] {
      const auto at = control.said.find("MOUNT ");
      if (at == std::string::npos) return;
      mounted.push_back(control.said[at + 6] - '0');
      control.mountBalls(static_cast<std::size_t>(mounted.back()));
    };
  }
  std::vector<int> mounted;
  Control control;

 protected:
  double tableWord() const { return table_ == 0 ? 0 : table_ - 'A' + 1; }
  double dry_;
  char table_;
};

// What an integrator edits in the places for the emulated lathe, mm.
inline const std::map<std::string, double> kPlacesOfLathe{
    {"_pb_safe_z", 280}, {"_pb_park_x", 150},  {"_pb_park_y", 0},    {"_pb_park_z", 320}, {"_pb_sphere_x", 120},
    {"_pb_sphere_y", 0}, {"_pb_sphere_z", 80}, {"_pb_axis_x", 0},    {"_pb_axis_y", 0},   {"_pb_setter_x", 160},
    {"_pb_setter_y", 0}, {"_pb_setter_z", 0},  {"_pb_plates_x", 70}, {"_pb_plates_y", 0}, {"_pb_plates_z", 30}};
inline const std::map<int, double> kTablesOfLathe{{1201, 60},  {1204, 45},   {1304, 0.001}, {1011, 0.41}, {1012, -0.23},
                                                  {1013, 120}, {1014, 0.15}, {1015, 0.2},   {1016, 200}};

// Where an integrator finds the balls of the emulated part, in all mounts, and its axes: a sensor head has to come near
// them. Numbers of tables, and names.
inline std::map<int, double> placesOfBalls() {
  std::map<int, double> places;
  const auto config = worldOfTheLoop();
  const auto& part = config.part_spindle;
  for (std::size_t ball = 0; ball < part.balls_mm.size(); ++ball) {
    for (std::size_t mount = 0; mount <= part.further_mounts.size(); ++mount) {
      const auto& as_described = part.balls_mm[ball];
      const auto at = mount == 0 ? as_described : world::inMount(part.further_mounts[mount - 1], as_described);
      const auto number = 1001 + 10 * (static_cast<int>(ball) + 1) + 3 * static_cast<int>(mount);
      for (std::size_t axis = 0; axis < 3; ++axis)
        places[number + static_cast<int>(axis)] = part.point_mm[axis] + at[axis];
    }
  }
  return places;
}
inline std::map<std::string, double> placesOfAxes() {
  const auto config = worldOfTheLoop();
  const auto &part = config.part_spindle.point_mm, &table = config.tilting_table->point_mm;
  return {{"_pb_axis_x", part[0]}, {"_pb_axis_y", part[1]}, {"_pb_table_y", table[1]}, {"_pb_table_z", table[2]}};
}

class OfTheKit final : public Session {
 public:
  explicit OfTheKit(double dry, char table = 0, const procedure::Facts& facts = usualFacts())
      : Session{dry, table, facts}, is_lathe_{!facts.has_y} {
    if (!is_lathe_) return;
    for (const auto& [number, mm] : kTablesOfLathe) kit.setTable(number, mm);
  }
  double run(const Asked& run) override {
    kit.call("begin", {});
    kit.variables["_pb_dry"] = dry_;
    kit.variables["_pb_table_word"] = tableWord();
    if (table_ != 0) {
      for (const auto& [number, mm] : placesOfBalls()) kit.setTable(number, mm);
      for (const auto& [name, mm] : placesOfAxes()) kit.variables[name] = mm;
    }
    if (is_lathe_) {
      for (const auto& [name, mm] : kPlacesOfLathe) kit.variables[name] = mm;
      kit.variables["_pb_has_y"] = kit.variables["_pb_orient"] = 0;
      kit.variables["_pb_rotary"] = 4;
    }
    kit.call("ask", {1, is_lathe_ ? 5.0 : 7.0});
    kit.call("stand", {1, 0, 0, 0});
    const double came = kit.call("run", run.asked());
    kit.call("stand", {control.tool() * 1.0, control.position('A'), control.position('B'), control.position('C')});
    return came;
  }
  Kit kit{control};

 private:
  bool is_lathe_;
};

class OfAText final : public Session {
 public:
  // axes: of a lathe that has a Y; one without has XZC.
  OfAText(const std::string& dialect, double dry, char table = 0, const procedure::Facts& facts = usualFacts(),
          const std::string& axes = {})
      : Session{dry, table, facts} {
    const bool is_lathe = !facts.has_y || !axes.empty();
    const std::string letters = !axes.empty() ? axes : is_lathe ? "XZC" : "XYZABC";
    const auto text = gcode::loop::loopProgram(dialect + (is_lathe ? "-lathe" : ""), letters);
    EXPECT_TRUE(text) << (text ? "" : text.error().what);
    if (dialect == "fanuc") {
      program = std::make_unique<FanucProgram>(control, *text, letters, is_lathe);
    } else {
      program = std::make_unique<SiemensProgram>(control, *text, facts.has_y, is_lathe);
    }
    if (!facts.has_y) {
      for (const auto& [name, mm] : kPlacesOfLathe) program->set(name, mm);
      for (const auto& [number, mm] : kTablesOfLathe) program->setTable(number, mm);
    }
    program->set("_pb_dry", dry_);
    program->set("_pb_table_word", tableWord());
    if (table == 0) return;
    for (const auto& [number, mm] : placesOfBalls()) program->setTable(number, mm);
    for (const auto& [name, mm] : placesOfAxes()) program->set(name, mm);
  }
  double run(const Asked& run) override {
    try {
      program->call(run.asked());
      EXPECT_EQ(program->get("main/came"), 0);
      alarm.clear();
    } catch (const Alarm& stopped) {
      alarm = stopped.what();
      EXPECT_NE(program->get("main/came"), 0) << alarm;
    }
    return program->get("main/came");
  }
  std::unique_ptr<TextProgram> program;
  std::string alarm;
};

// A Fanuc calls the tool that is in the spindle once more, since it cannot know.
inline std::vector<Commanded> withoutIdleChanges(const std::vector<Commanded>& all) {
  std::vector<Commanded> rest;
  double tool = 1;
  for (const auto& one : all) {
    if (one.is == Commanded::Is::tool && one.to[0] == tool) continue;
    if (one.is == Commanded::Is::tool) tool = one.to[0];
    rest.push_back(one);
  }
  return rest;
}

inline void expectSame(const std::vector<Commanded>& of_kit, const std::vector<Commanded>& of_text, std::size_t from,
                       double within = 1e-6) {
  ASSERT_EQ(of_kit.size(), of_text.size());
  for (std::size_t i = from; i < of_kit.size(); ++i) {
    const auto &one = of_kit[i], &other = of_text[i];
    ASSERT_EQ(one.is, other.is) << i;
    for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_NEAR(one.to[axis], other.to[axis], within) << i;
    ASSERT_NEAR(one.feed, other.feed, 1e-6) << i;
    ASSERT_EQ(one.guarded, other.guarded) << i;
    ASSERT_EQ(one.clockwise, other.clockwise) << i;
    for (std::size_t axis = 0; axis < 2; ++axis) ASSERT_NEAR(one.centre[axis], other.centre[axis], 1e-6) << i;
  }
}

}  // namespace probebox::scenario
