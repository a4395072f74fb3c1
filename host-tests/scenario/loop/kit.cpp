#include "kit.hpp"

#include <cmath>

#include "protocol/modbus/page.hpp"
#include "protocol/units/angle.hpp"
#include "tools/gcode/loop/areas.hpp"
#include "tools/gcode/loop/sources.hpp"

namespace probebox::scenario {
namespace {

namespace address = modbus::address;
using gcode::loop::Statement;
using gcode::loop::Value;

constexpr double kRefusedWrite = 1003;

}  // namespace

Kit::Kit(Control& control) : control_{control} {
  for (const auto source : gcode::loop::sources()) {
    auto some = gcode::loop::subprogramsOf(source);
    if (!some) throw Alarm{some.error().what};
    for (auto& one : *some) subprograms_[one.name] = std::move(one);
  }
}

double Kit::call(const std::string& name, const std::vector<double>& arguments) {
  if (name == "ask") return variables["_value"] = ask(arguments);
  if (name == "frame" || name == "keep") return 0;  // of LinuxCNC itself: host-tests/cnc/frame_test.py
  const auto found = subprograms_.find(name);
  if (found == subprograms_.end()) throw Alarm{"no subprogram " + name};
  for (std::size_t i = 0; i < arguments.size(); ++i) variables[name + "/" + std::to_string(i + 1)] = arguments[i];
  body(found->second.body);
  return variables["_value"];
}

Kit::Left Kit::body(const std::vector<Statement>& statements) {
  for (const auto& one : statements) {
    if (const auto left = statement(one); left != Left::no) return left;
  }
  return Left::no;
}

Kit::Left Kit::choice(const Statement& one) {
  for (std::size_t i = 0; i < one.bodies.size(); ++i) {
    if (i >= one.values.size() || value(one.values[i]) != 0) return body(one.bodies[i]);
  }
  return Left::no;
}

Kit::Left Kit::statement(const Statement& one) {
  switch (one.is) {
    case Statement::Is::comment:
      return Left::no;
    case Statement::Is::message:
      control_.said = one.text;
      return Left::no;
    case Statement::Is::abort:
      throw Alarm{one.text};
    case Statement::Is::assign: {
      const double now = value(one.values[1]);
      const Value& to = one.values[0];
      const auto preset =
          to.is == Value::Is::table ? preset_.find(static_cast<int>(value(to.arguments[0]))) : preset_.end();
      place(to) = preset == preset_.end() ? now : preset->second;
      return Left::no;
    }
    case Statement::Is::call: {
      std::vector<double> given;
      for (const auto& argument : one.values) given.push_back(value(argument));
      call(one.text, given);
      return Left::no;
    }
    case Statement::Is::choice:
      return choice(one);
    case Statement::Is::repeat:
      while (value(one.values[0]) != 0) {
        const auto left = body(one.bodies[0]);
        if (left == Left::subprogram) return left;
        if (left == Left::loop) break;
      }
      return Left::no;
    case Statement::Is::leave:
      return Left::loop;
    case Statement::Is::give:
      variables["_value"] = value(one.values[0]);
      return Left::subprogram;
    case Statement::Is::block:
      block(one);
      return Left::no;
  }
  return Left::no;
}

void Kit::block(const Statement& one) {
  std::map<char, double> words;
  double g = -1, m = -1;
  for (const auto& word : one.words) {
    (word.letter == 'G' ? g : word.letter == 'M' ? m : words[word.letter]) = value(word.value);
  }
  if (g == 4) return control_.wait(words['P']);
  if (m == 6) return control_.takeTool(static_cast<unsigned>(words['T']));
  if (m == 64 || m == 65) pressing_ = m == 64;
  if (m == 0) return control_.stop();
  if (m == 9) return control_.endCoolant();
  if (m == 19) return control_.orient();
  if (g == 2 || g == 3)
    return control_.arc({words.at('X'), words.at('Y')}, {words.at('I'), words.at('J')}, words.at('F'), g == 2);
  if (g == 38.3 && words.contains('C')) return control_.turnUntilTouched(words.at('C'), words.at('F'));
  if (g == 38.3) return control_.seek({words.at('X'), words.at('Y'), words.at('Z')}, words.at('F'));
  if (g != 0 && g != 1) return;
  if (words.contains('A') || words.contains('B') || words.contains('C')) {
    std::array<double, 3> to{};
    for (const char axis : {'A', 'B', 'C'})
      to.at(static_cast<std::size_t>(axis - 'A')) = words.contains(axis) ? words[axis] : control_.position(axis);
    return control_.turn(to, g == 1 ? words.at('F') : 0);
  }
  std::array<double, 3> to{};
  for (const char axis : {'X', 'Y', 'Z'})
    to.at(static_cast<std::size_t>(axis - 'X')) = words.contains(axis) ? words[axis] : control_.position(axis);
  if (words.contains('F')) variables["feed"] = words['F'];
  control_.move(to, variables["feed"], !pressing_);
}

double& Kit::place(const Value& of) {
  if (of.is == Value::Is::table) return tables_[static_cast<int>(value(of.arguments[0]))];
  if (of.is != Value::Is::variable) throw Alarm{"nothing to assign to"};
  return variables[of.name];
}

double Kit::pin(const std::string& name) {
  if (gcode::loop::ofStep(name)) return step_[name];
  return variables[name];
}

double Kit::value(const Value& of) {
  switch (of.is) {
    case Value::Is::number:
      return of.number;
    case Value::Is::variable:
      if (of.name == "_tool" || of.name == "_current_tool") return control_.tool();
      if (of.name == "_x" || of.name == "_y" || of.name == "_z")
        return control_.position(static_cast<char>(of.name[1] - 'a' + 'A'));
      if (of.name == "_a" || of.name == "_b" || of.name == "_c")
        return control_.position(static_cast<char>(of.name[1] - 'a' + 'A'));
      return variables[of.name];
    case Value::Is::table:
      return tables_[static_cast<int>(value(of.arguments[0]))];
    case Value::Is::pin:
      return pin(of.name);
    case Value::Is::call: {
      const double x = value(of.arguments[0]);
      if (of.name == "ABS") return std::abs(x);
      if (of.name == "FIX") return std::floor(x);
      if (of.name == "SQRT") return std::sqrt(x);
      if (of.name == "SIN") return std::sin(x * kDegree);
      return std::cos(x * kDegree);
    }
    case Value::Is::operation:
      return operation(of);
  }
  return 0;
}

double Kit::operation(const Value& of) {
  const double a = value(of.arguments[0]), b = value(of.arguments[1]);
  static const std::map<std::string, double (*)(double, double)> kOperations{
      {"+", [](double x, double y) { return x + y; }},
      {"-", [](double x, double y) { return x - y; }},
      {"*", [](double x, double y) { return x * y; }},
      {"/", [](double x, double y) { return x / y; }},
      {"MOD", [](double x, double y) { return std::fmod(x, y); }},
      {"EQ", [](double x, double y) { return x == y ? 1.0 : 0.0; }},
      {"NE", [](double x, double y) { return x != y ? 1.0 : 0.0; }},
      {"LT", [](double x, double y) { return x < y ? 1.0 : 0.0; }},
      {"LE", [](double x, double y) { return x <= y ? 1.0 : 0.0; }},
      {"GT", [](double x, double y) { return x > y ? 1.0 : 0.0; }},
      {"GE", [](double x, double y) { return x >= y ? 1.0 : 0.0; }},
      {"AND", [](double x, double y) { return x != 0 && y != 0 ? 1.0 : 0.0; }},
      {"OR", [](double x, double y) { return x != 0 || y != 0 ? 1.0 : 0.0; }},
  };
  return kOperations.at(of.name)(a, b);
}

void Kit::look() {
  for (const auto& entry : modbus::registers()) {
    const auto name = modbus::halPinOf(entry);
    if (gcode::loop::ofStep(name)) step_[name] = control_.registers().value(entry.address);
  }
}

double Kit::mark(int phase) {
  auto& box = control_.registers();
  look();
  const auto before = step_;
  const auto commit = box.value(address::marker_commit) + 1;
  const bool taken = box.write(address::marker_run,
                               {step_["probebox.step-run"], step_["probebox.step-number"], phase * 1.0,
                                step_["probebox.step-speed"], control_.tool() * 1.0, control_.positionOfTheBox('A'),
                                control_.positionOfTheBox('B'), control_.positionOfTheBox('C'), 1, commit});
  if (!taken) return kRefusedWrite;
  for (int tries = 0; tries < 40; ++tries) {
    control_.wait(0.05);
    look();
    for (const char* name : {"state", "number", "repeats", "run"}) {
      const auto key = std::string{"probebox.step-"} + name;
      if (step_[key] != before.at(key)) return 0;
    }
  }
  return 0;
}

double Kit::controller_request(double what, double of, const std::vector<double>& chosen) {
  auto& box = control_.registers();
  if (what == 1) {
    const auto at = [&](std::size_t i) { return i < chosen.size() ? chosen[i] : 0.0; };
    std::vector<double> options(22, 0.0);
    options[0] = at(1);
    options[16] = at(2);
    options[18] = at(3);
    options[19] = at(4);
    options[21] = at(5);
    if (!box.write(address::request_method, options) || !box.write(address::request_contacts, {at(6)}))
      return kRefusedWrite;
  }
  const auto commit = box.value(address::request_commit) + 1;
  if (!box.write(address::request_of, {of, what, commit})) return kRefusedWrite;
  for (int tries = 0; tries < 200; ++tries) {
    control_.wait(0.05);
    const auto outcome = box.value(address::request_outcome);
    if (box.value(address::request_answered) != commit || outcome < 2) continue;
    variables["probebox.result-1"] = box.value(address::request_number);
    return outcome == 3 ? box.value(address::request_refusal) : 0;
  }
  return 2000;
}

double Kit::ask(const std::vector<double>& what) {
  auto& box = control_.registers();
  const auto at = [&](std::size_t i) { return i < what.size() ? what[i] : 0.0; };
  switch (static_cast<int>(what[0])) {
    case 1: {
      const auto commit = box.value(address::home_commit) + 1;
      return box.write(address::home_position,
                       {control_.position('X'), control_.position('Y'), control_.position('Z'), at(1), commit})
                 ? 0
                 : kRefusedWrite;
    }
    case 2: {
      const auto commit = box.value(address::pose_commit) + 1;
      return box.write(address::pose_angle, {control_.positionOfTheBox('A'), control_.positionOfTheBox('B'),
                                             control_.positionOfTheBox('C'), at(1), control_.tool() * 1.0, 0, commit})
                 ? 0
                 : kRefusedWrite;
    }
    case 3:
      return controller_request(1, 0, what);
    case 7:
      if (box.value(address::calibration_result) == 0) return 0;
      return controller_request(at(1) == 1 ? 4 : 3, box.value(address::calibration_result), {});
    case 8:
      return controller_request(2, 0, {});
    case 12:
      look();
      return 0;
    case 13:
      return mark(3);
    default:
      return mark(static_cast<int>(what[0]) - 4);
  }
}

}  // namespace probebox::scenario
