#include "tools/gcode/loop/writer.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <regex>
#include <utility>

namespace probebox::gcode::loop {
namespace {

constexpr std::size_t kColumns = 76;  // of a comment
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kOpposites{
    {{"EQ", "NE"}, {"NE", "EQ"}, {"LT", "GE"}, {"GE", "LT"}, {"GT", "LE"}, {"LE", "GT"}}};

std::string_view oppositeOf(std::string_view relation) {
  const auto found = std::ranges::find(kOpposites, relation, &std::pair<std::string_view, std::string_view>::first);
  return found == kOpposites.end() ? std::string_view{} : found->second;
}

}  // namespace

Outcome<std::string> Writer::write(const std::vector<Subprogram>& subprograms) {
  for (const auto& subprogram : subprograms) {
    by_name_.emplace(subprogram.name, &subprogram);
    gather(subprogram.body);
  }
  begin(subprograms);
  for (const auto& subprogram : subprograms) {
    owner_ = subprogram.name;
    end_label_ = newLabel();
    pressing_ = false;
    beginSubprogram(subprogram);
    if (subprogram.name == "look") {
      look();
    } else {
      body(subprogram.body);
    }
    label(end_label_);
    endSubprogram();
  }
  end();
  if (failure_) return *failure_;
  return std::move(text_);
}

void Writer::fail(const std::string& what) {
  if (!failure_) failure_ = Error{"probebox_" + owner_ + ": " + what};
}

// Words of the kit in those of this control: "_pb_dry", "probebox_places.ngc", "#1" of the subprogram, "#[1200 + number
// of a tool]".
std::string Writer::said(std::string_view kits) {
  static const std::regex kWord{R"(_pb_\w+|probebox_(\w+)\.ngc|#\[(\d{4}) \+ ([^\]]+)\]|#(\d)(?!\d))"};
  std::string all;
  auto from = kits.begin();
  for (std::cregex_iterator word{kits.data(), kits.data() + kits.size(), kWord}, end; word != end; ++word) {
    all.append(from, kits.begin() + word->position());
    from = kits.begin() + word->position() + word->length();
    if ((*word)[1].matched) {
      all += programNamed((*word)[1]);
    } else if ((*word)[2].matched) {
      all += placeSaid(placeOfTable(std::stoi((*word)[2])), (*word)[3]);
    } else if ((*word)[4].matched) {
      all += variable(owner_ + "/" + (*word)[4].str());
    } else {
      all += variable(word->str());
    }
  }
  return all.append(from, kits.end());
}

void Writer::comments(std::string_view kits) {
  const std::string all = said(kits);
  std::string_view text = all;
  while (text.size() > kColumns) {
    auto cut = text.rfind(' ', kColumns);
    if (cut == std::string_view::npos || cut == 0) cut = kColumns;
    line(comment(text.substr(0, cut)));
    text.remove_prefix(std::min(text.size(), text[cut] == ' ' ? cut + 1 : cut));
  }
  if (!text.empty()) line(comment(text));
}

void Writer::explain(std::string_view control, const std::vector<std::string>& needs) {
  comments("Loop program of a probebox for " + std::string{control} +
           ". The box says by its registers which step is to be done. This program was not run on a control: it is the "
           "loop program of the LinuxCNC kit, which LinuxCNC does run, in another language.");
  comments(
      "The box only advises: no motion stop depends on it. The probe's skip input stays wired to the control, and "
      "stops "
      "every move but those that press the probe into a surface.");
  comments(
      "First of all edit the places, heights, tools and limits below (probebox_places.ngc). Each run goes its whole "
      "way "
      "above "
      "everything, stops, and touches at the next start. Override low, a hand on it. At the touches the override is "
      "100 "
      "percent.");
  comments(
      "The probe has to be switched on before the start and until the end: a wireless one by the M code or the turn "
      "that "
      "its maker says. While it is off the control sees no touch, and nothing stops any move.");
  for (const auto& need : needs) comments(need);
  comments(
      "Areas that the PLC transfers, in words of 16 bits. Read them in turn, every 100 ms or faster, each by one "
      "request "
      "(function 3):");
  const auto range = [](const Area& area, std::uint16_t from) {
    return std::to_string(from) + " to " + std::to_string(from + area.count - 1);
  };
  for (const auto& area : areasRead())
    comments("registers " + range(area, area.first) + " into words " + range(area, area.word));
  comments(
      "Write these (function 16) when the commit that is named differs from the one that was sent last, until the box "
      "has answered, be it by an exception; send nothing after a start of the PLC until then. Where one commit sends "
      "three, in this order:");
  for (const auto& area : areasWritten())
    comments("words " + range(area, area.word) + " to registers " + range(area, area.first) + ", commit " +
             std::to_string(area.commit));
}

void Writer::gather(const Value& value) {
  if (value.is == Value::Is::pin && ofStep(value.name)) step_pins_.insert(value.name);
  for (const auto& argument : value.arguments) gather(argument);
}

void Writer::gather(const std::vector<Statement>& statements) {
  for (const auto& one : statements) {
    for (const auto& value : one.values) gather(value);
    for (const auto& word : one.words) gather(word.value);
    for (const auto& each : one.bodies) gather(each);
  }
}

std::string Writer::number(double value) const {
  std::array<char, 48> digits{};
  std::snprintf(digits.data(), digits.size(), "%.6f", value);
  std::string text{digits.data()};
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string Writer::text(const Value& value) {
  switch (value.is) {
    case Value::Is::number:
      return number(value.number);
    case Value::Is::variable: {
      if (value.name == "_tool") return tool();
      if (value.name == "_current_tool") return toolForSure();
      for (const char letter : {'X', 'Y', 'Z', 'A', 'B', 'C'}) {
        if (value.name != std::string{"_"} + static_cast<char>(letter - 'A' + 'a')) continue;
        if (!has(letter)) return number(0);
        return letter >= 'X' ? commanded(letter) : position(letter);
      }
      if (value.name == "_lathe_diameter_mode") return number(0);  // settings() has it
      return variable(value.name == "_value" ? "_pb_value" : value.name);
    }
    case Value::Is::table: {
      Value index = value.arguments[0];
      shift(index);
      return table(text(index));
    }
    case Value::Is::pin: {
      if (ofStep(value.name)) return variable(copyOf(value.name));
      if (value.name.starts_with("probebox.position-")) {
        const auto letter = static_cast<char>(value.name.back() - 'a' + 'A');
        return has(letter) ? position(letter) : number(0);
      }
      if (const auto place = placeRead(value.name)) return read(*place);
      return variable(copyOf(value.name));
    }
    case Value::Is::call:
      return call(value.name, text(value.arguments[0]));
    case Value::Is::operation:
      break;
  }
  const auto left = text(value.arguments[0]), right = text(value.arguments[1]);
  if (!oppositeOf(value.name).empty() || value.name == "AND" || value.name == "OR") fail("a condition as a value");
  return value.name == "MOD" ? remainder(left, right) : operation(left, value.name, right);
}

// The first constant of an index names the table.
bool Writer::shift(Value& index) const {
  if (index.is == Value::Is::number) {
    index.number = placeOfTable(static_cast<int>(index.number));
    return true;
  }
  return !index.arguments.empty() && shift(index.arguments[0]);
}

void Writer::body(const std::vector<Statement>& statements) {
  for (const auto& one : statements) statement(one);
}

void Writer::statement(const Statement& one) {
  switch (one.is) {
    case Statement::Is::comment:
      return comments(one.text);
    case Statement::Is::message:
      return message(said(one.text));
    case Statement::Is::abort:
      return abort(said(one.text));
    case Statement::Is::assign:
      return assignment(one);
    case Statement::Is::call: {
      // LinuxCNC's own: settings() and begin of this control have theirs.
      if (one.text == "frame" || one.text == "keep") return;
      if (!by_name_.contains(one.text) && one.text != "look") return fail("there is no subprogram " + one.text);
      std::vector<std::string> given;
      for (const auto& argument : one.values) given.push_back(text(argument));
      for (std::size_t i = 0; i < given.size(); ++i) assign(variable(one.text + "/" + std::to_string(i + 1)), given[i]);
      return callSubprogram(one.text);
    }
    case Statement::Is::choice:
      return choice(one);
    case Statement::Is::repeat:
      return repeat(one);
    case Statement::Is::leave:
      return loops_.empty() ? fail("a break outside of a loop") : jump(loops_.back());
    case Statement::Is::give:
      assign(variable("_pb_value"), text(one.values[0]));
      return jump(end_label_);
    case Statement::Is::block:
      return block(one);
  }
}

void Writer::assignment(const Statement& one) {
  const Value& target = one.values[0];
  if (!one.text.empty()) comments(one.text);
  const auto known = knownByAxes(target.name);
  const auto value = known ? number(*known) : text(one.values[1]);
  if (target.is == Value::Is::pin) {
    if (const auto place = placeWritten(target.name)) return write(*place, value);
    if (placeRead(target.name)) return fail(target.name + " is not written");
    return assign(variable(copyOf(target.name)), value);
  }
  if (target.is != Value::Is::variable && target.is != Value::Is::table) return fail("nothing can be assigned to that");
  assign(text(target), value);
}

void Writer::jumpUnlessRelation(const Value& condition, int to) {
  const auto opposite = oppositeOf(condition.name);
  if (condition.is != Value::Is::operation || opposite.empty()) return fail("no condition");
  const auto left = text(condition.arguments[0]), right = text(condition.arguments[1]);
  jumpIf(left, opposite, right, to);
}

// As _pb_rotary counts them.
int Writer::rotaryAxes() const {
  return (has('A') ? 1 : 0) + (has('B') ? 2 : 0) + (has('C') ? 4 : 0);
}

// Settings of the places that follow from the axes of the control, in place of the kit's.
std::optional<double> Writer::knownByAxes(std::string_view name) const {
  if (name == "_pb_rotary") return rotaryAxes();
  if (name == "_pb_has_y") return has('Y') ? 1 : 0;
  if (name == "_pb_home" && !has('Y')) return 5;
  if (name == "_pb_orient" && axes_.lathe) return 0;  // no probe in a turret turns
  return std::nullopt;
}

std::string Writer::linearAxes() const {
  std::string letters;
  for (const char axis : {'X', 'Y', 'Z'}) {
    if (has(axis)) letters += axis;
  }
  return letters;
}

// One comparison a jump: controls differ in how they join several.
void Writer::jumpUnless(const Value& condition, int to) {
  if (condition.is == Value::Is::operation && condition.name == "AND") {
    jumpUnless(condition.arguments[0], to);
    return jumpUnless(condition.arguments[1], to);
  }
  if (condition.is == Value::Is::operation && condition.name == "OR") {
    const int next = newLabel(), holds = newLabel();
    jumpUnless(condition.arguments[0], next);
    jump(holds);
    label(next);
    jumpUnless(condition.arguments[1], to);
    return label(holds);
  }
  jumpUnlessRelation(condition, to);
}

// True for a statement that settings() has already written.
bool Writer::isSetting(const Statement& one) {
  if (one.is != Statement::Is::block) return false;
  return std::ranges::any_of(one.words, [](const Word& word) {
    return word.letter == 'G' && word.value.is == Value::Is::number && word.value.number == 10;
  });
}

void Writer::choice(const Statement& one) {
  if (std::ranges::all_of(one.bodies, [](const auto& each) { return std::ranges::all_of(each, isSetting); })) return;
  const int behind = newLabel();
  for (std::size_t i = 0; i < one.bodies.size(); ++i) {
    if (i >= one.values.size()) {
      body(one.bodies[i]);
      continue;
    }
    const bool last = i + 1 == one.bodies.size();
    const int next = last ? behind : newLabel();
    jumpUnless(one.values[i], next);
    body(one.bodies[i]);
    if (last) continue;
    jump(behind);
    label(next);
  }
  label(behind);
}

void Writer::repeat(const Statement& one) {
  const int again = newLabel(), behind = newLabel();
  loops_.push_back(behind);
  label(again);
  jumpUnless(one.values[0], behind);
  body(one.bodies[0]);
  jump(again);
  label(behind);
  loops_.pop_back();
}

void Writer::block(const Statement& one) {
  std::map<char, std::string> words;
  std::set<int> g, m;
  for (const auto& word : one.words) {
    if (word.letter == 'G') {
      g.insert(static_cast<int>(10 * word.value.number + 0.5));
    } else if (word.letter == 'M') {
      m.insert(static_cast<int>(word.value.number));
    } else {
      words[word.letter] = text(word.value);
    }
  }
  if (g.contains(170)) return settings();
  // settings() has them: on these controls G61 is an exact stop.
  for (const int code : {80, 100, 593, 610, 611}) {
    if (g.contains(code)) return;
  }
  if (g.contains(40)) return wait(words['P']);
  if (g.contains(0) || g.contains(10)) return motion(one, words, Turn::freely);
  if (g.contains(383)) return motion(one, words, Turn::until_touched);
  if (g.contains(20) || g.contains(30)) return circle(words, g.contains(20));
  if (m.contains(6)) return takeTool(words['T']);
  if (m.contains(0)) return stop();
  if (m.contains(9)) return;                  // settings() has it
  if (m.contains(19) && axes_.lathe) return;  // it would turn the part
  if (m.contains(19)) return orient();
  if (m.contains(66)) return settle();
  if (m.contains(64) || m.contains(65)) {
    pressing_ = m.contains(64);
    return;
  }
  fail("unknown block " + one.text);
}

// No skip input ends an arc.
void Writer::circle(const std::map<char, std::string>& words, bool clockwise) {
  if (!pressing_) return fail("an arc that the probe is to stop");
  if (!has('Y')) return abort("A SCAN NEEDS THE AXIS Y");
  arc({{'X', words.at('X')}, {'Y', words.at('Y')}}, {words.at('I'), words.at('J')}, words.at('F'), clockwise);
}

void Writer::motion(const Statement& one, const std::map<char, std::string>& words, Turn how) {
  std::map<char, std::string> linear, rotary;
  for (const auto& [letter, value] : words) {
    if (letter >= 'X' && has(letter)) linear[letter] = value;
    if (letter <= 'C') rotary[letter] = value;
  }
  const auto feed = words.find('F');
  if (how == Turn::until_touched && feed == words.end()) return fail("a way to a contact without a feed: " + one.text);
  if (!linear.empty() && !rotary.empty()) return fail("linear and rotary axes in one block: " + one.text);
  if (!linear.empty() && how == Turn::until_touched) return seek(linear, feed->second);
  if (!linear.empty()) return move(linear, feed == words.end() ? std::string{} : feed->second, !pressing_);
  for (const auto& [letter, value] : rotary) {
    if (!has(letter)) return abort(std::string{"A STEP TURNS AN AXIS THAT IS NOT THERE: "} + letter);
  }
  if (!rotary.empty()) turn(rotary, feed == words.end() ? std::string{} : feed->second, how);
}

}  // namespace probebox::gcode::loop
