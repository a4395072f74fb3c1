#include "text_program.hpp"

#include <algorithm>
#include <cmath>

#include "block_words.hpp"

namespace probebox::scenario {
namespace {

// #4000 and more of a Fanuc: the modal group of a G code; 0 for one that is not modal.
int groupOf(double code) {
  if (code >= 17 && code <= 19) return 4002;
  if (code == 90 || code == 91) return 4003;
  if (code == 94 || code == 95) return 4005;
  if (code == 20 || code == 21) return 4006;
  if (code == 40) return 4007;
  if (code == 49) return 4008;
  if (code == 80) return 4009;
  if (code >= 54 && code <= 59) return 4014;
  if (code >= 61 && code <= 64) return 4015;
  return 0;
}

// The same of the turning system A, which has the other codes as cycles or not at all.
int groupOfLathe(double code) {
  if (code >= 17 && code <= 19) return 4016;
  if (code == 98 || code == 99) return 4005;
  if (code == 20 || code == 21) return 4006;
  if (code == 40) return 4007;
  if (code == 80) return 4010;
  if (code >= 54 && code <= 59) return 4014;
  if (code >= 61 && code <= 64) return 4015;
  constexpr std::array kOthers{0.0, 1.0, 2.0, 3.0, 4.0, 10.0, 31.0, 53.0};
  if (std::ranges::find(kOthers, code) != kOthers.end()) return 0;
  throw Alarm{"G" + std::to_string(code) + " is a cycle of system A, or none of its codes"};
}

}  // namespace

void TextProgram::run(const std::string& name) {
  const auto found = programs_.find(name);
  if (found == programs_.end()) throw Alarm{"no program " + name};
  constexpr int kDeepest = 10;  // levels of M98 that a control has
  if (depth_ > kDeepest) throw Alarm{"subprograms are too deep in each other: " + name};
  struct Level {
    explicit Level(int& of) : depth{of} { ++depth; }
    ~Level() { --depth; }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;
    int& depth;
  } const level{depth_};
  const Lines& lines = found->second;
  for (std::size_t at = 0; at < lines.size(); ++at) {
    last = name + ": " + lines[at];
    const auto then = line(lines[at]);
    if (then == "return") return;
    if (then.empty()) continue;
    const auto label = std::ranges::find_if(lines, [&](const auto& one) { return isLabel(one, then.substr(2)); });
    if (label == lines.end()) throw Alarm{"no label " + then + " in " + name};
    at = static_cast<std::size_t>(label - lines.begin());
  }
}

void TextProgram::turnBy(const std::map<char, std::string>& words, double feed_deg_min) {
  std::array<double, 3> to{};
  for (const char axis : {'A', 'B', 'C'}) {
    const auto word = words.find(axis);
    const auto index = static_cast<std::size_t>(axis - 'A');
    to.at(index) = word == words.end() ? control_.position(axis) : valueOf(word->second) + shiftOf(3 + index);
  }
  control_.turn(to, feed_deg_min);
}

FanucProgram::FanucProgram(Control& control, std::string_view text, std::string letters, bool is_lathe)
    : TextProgram{control}, letters_{std::move(letters)}, is_lathe_{is_lathe} {
  if (is_lathe_) {
    modal = {{4004, 69}, {4005, 99}, {4006, 21}, {4007, 40}, {4010, 80}, {4011, 50}, {4014, 55},
             {4015, 64}, {4016, 18}, {4017, 69}, {4021, 13}, {4022, 50}, {4130, 0}};
    offsets = {{54, {-620, -410, 0}}, {55, {-600, -400, 30}}, {59, {2, 3, 7}}};
  }
  known_ = [this](const std::string&, double index) { return read(static_cast<int>(std::lround(index))); };
  std::istringstream all{std::string{text}};
  std::string name;
  for (std::string one; std::getline(all, one);) {
    if (one == "%") continue;
    if (one.starts_with("O")) {
      name = one.substr(1, one.find(' ') - 1);
      if (first_.empty()) first_ = name;
      continue;
    }
    if (name.starts_with(first_.substr(0, 2)) && name.ends_with("49") && one.starts_with("(#")) {
      std::istringstream words{one.substr(2, one.size() - 3)};
      int number = 0;
      std::string of;
      words >> number >> of;
      numbers_[of] = number;
    }
    if (one.empty() || one.front() == '(') continue;
    // "N1 G53" is a label, and then a block.
    const auto space = one.front() == 'N' ? one.find(' ') : std::string::npos;
    if (space != std::string::npos) programs_[name].push_back(one.substr(0, space));
    programs_[name].push_back(space == std::string::npos ? one : one.substr(space + 1));
  }
}

void FanucProgram::call(const std::vector<double>& arguments) {
  for (std::size_t i = 0; i < 6; ++i) variables_[static_cast<int>(i) + 1] = i < arguments.size() ? arguments[i] : 0;
  run(first_);
}

double FanucProgram::read(int number) {
  for (std::size_t i = 0; i < letters_.size(); ++i) {
    const char axis = letters_[i];
    const auto of_axis = std::string_view{"XYZABC"}.find(axis);
    if (number == 5021 + static_cast<int>(i)) return inWords(axis, control_.position(axis));
    if (number == 5041 + static_cast<int>(i)) return inWords(axis, control_.position(axis) - shiftOf(of_axis));
  }
  if (number >= 7001 && number <= 7960)
    return offsets[kFurther + (number - 7001) / 20].at(static_cast<std::size_t>((number - 7001) % 20));
  if (number >= 5221 && number <= 5326)
    return offsets.at(54 + (number - 5221) / 20).at(static_cast<std::size_t>((number - 5221) % 20));
  if (const auto found = modal.find(number); found != modal.end()) return found->second;
  if (number == 4120 && is_lathe_) return 100 * commanded_tool.value_or(control_.tool()) + tool_offset;
  if (number == 4120) return commanded_tool ? *commanded_tool : control_.tool();
  if (number == kToolOfTheBuilder) return control_.tool();
  if (number == 1033)
    return static_cast<std::int32_t>(control_.plc().answer(static_cast<std::uint32_t>(variables_[1133])));
  if (number >= 1000 && number != 1133) throw Alarm{"no variable #" + std::to_string(number)};
  return variables_[number];
}

double FanucProgram::shiftOf(std::size_t axis) const {
  const char letter = "XYZABC"[axis];
  const auto index = letters_.find(letter);
  if (index == std::string::npos) return 0;
  const bool has_length = is_lathe_ ? tool_offset != 0 : modal.at(4008) == 43;
  const double length_mm = axis == 2 && has_length ? length : 0;
  const double frame = modal.at(4014);
  const int at = frame == 54.1 ? kFurther - 1 + static_cast<int>(modal.at(4130)) : static_cast<int>(frame);
  return outOfWords(letter, offsets.at(at).at(index) + local.at(index)) + length_mm;
}

double FanucProgram::get(const std::string& name) const {
  const auto found = variables_.find(numbers_.at(upper(name)));
  return found == variables_.end() ? 0 : found->second;
}

void FanucProgram::write(int number, double value) {
  if (number == 3000) throw Alarm{"#3000 " + last};
  if (is_lathe_ && number >= 5321 && number < 5321 + static_cast<int>(letters_.size())) {
    offsets.at(59).at(static_cast<std::size_t>(number - 5321)) = value;
    return;
  }
  if (number > 999 && number != 1133) throw Alarm{"no variable #" + std::to_string(number)};
  for (const auto& [name, preset] : preset_) {
    if (numbers_.at(upper(name)) == number) value = preset;
  }
  // As the writer places them: balls from #700, tools from #800.
  const int in_kit = number < 800 ? number + 300 : number + 400;
  if (const auto preset = preset_table_.find(in_kit); preset != preset_table_.end() && number >= 700)
    value = preset->second;
  variables_[number] = value;
}

std::string FanucProgram::line(const std::string& text) {
  if (text == "M99") return "return";
  if (text.starts_with("GOTO ")) return "->" + text.substr(5);
  if (text.starts_with("IF [")) {
    const auto then = text.rfind("] THEN ");
    if (then != std::string::npos) return holds(text.substr(4, then - 4), known_) ? line(text.substr(then + 7)) : "";
    const auto end = text.rfind("] GOTO ");
    return holds(text.substr(4, end - 4), known_) ? "->" + text.substr(end + 7) : "";
  }
  if (text.starts_with("#3006=1 (")) {
    control_.said = text.substr(9, text.size() - 10);
    if (control_.said.size() > 26) throw Alarm{"a message that is not shown as a whole: " + text};
    control_.stop();
    return {};
  }
  if (text.starts_with("M98 P")) {
    run(text.substr(5));
    return {};
  }
  if (text.front() == '#') {
    const auto equals = text.find('=');
    const auto end = text.starts_with("#3000") ? text.find(' ') : text.size();
    const double value = valueOf(text.substr(equals + 1, end - equals - 1));
    write(static_cast<int>(std::lround(valueOf(text.substr(1, equals - 1)))), value);
    return {};
  }
  if (text.front() == 'N') return {};
  block(text);
  return {};
}

void FanucProgram::block(const std::string& text) {
  auto words = wordsOf(text);
  const auto value = [&](char letter) { return valueOf(words[letter]); };
  if (text == "G53") return control_.wait(0.008);
  if (text == "M0") return control_.stop();
  if (text == "M9") return control_.endCoolant();
  if (text == "M19") return control_.orient();
  if (text.starts_with("T") && is_lathe_) return turnTurret(static_cast<unsigned>(value('T')));
  if (text.starts_with("T")) return takeTool(static_cast<unsigned>(value('T')));
  std::set<double> codes;
  for (const auto& code : codesOf(text)) codes.insert(valueOf(code));
  if (codes.contains(4)) return control_.wait(value('P') / 1000);
  // With parameter 5006 bit 6 (TOS) = 0.
  const bool in_machine_frame = codes.contains(53) && words.contains('Z');
  if (codes.contains(49) && !is_lathe_ && modal[4008] != 49 && !in_machine_frame)
    throw Alarm{"G49 moves Z by the tool's length"};
  if (in_machine_frame && std::abs(value('Z') - control_.position('Z')) > 1e-6) throw Alarm{"G53 moves Z"};
  for (const double code : codes) {
    if (const int group = is_lathe_ ? groupOfLathe(code) : groupOf(code); group != 0) modal[group] = code;
    if (code == 54.1) modal[4130] = value('P');
  }
  if (codes.contains(10)) {
    const int first = words.contains('L') && value('L') == 20 ? kFurther - 1 : 53;
    for (std::size_t axis = 0; axis < letters_.size(); ++axis) {
      if (words.contains(letters_[axis]))
        offsets.at(first + static_cast<int>(value('P'))).at(axis) = value(letters_[axis]);
    }
    return;
  }
  const bool guarded = codes.contains(31), round = codes.contains(2) || codes.contains(3);
  if (!guarded && !round && !codes.contains(1) && !(codes.contains(0) && !in_machine_frame)) {
    if (codes.empty()) throw Alarm{"an unknown block: " + text};
    return;
  }
  const std::map<int, int> mill{{4003, 90}, {4005, 94}, {4006, 21}}, lathe{{4005, 98}, {4006, 21}};
  for (const auto& [group, needed] : is_lathe_ ? lathe : mill) {
    if (modal[group] != needed) throw Alarm{"a move without G" + std::to_string(needed)};
  }
  if (codes.contains(0)) return turnBy(words);
  if (round) {
    if (modal[is_lathe_ ? 4016 : 4002] != 17) throw Alarm{"an arc in another plane than G17"};
    const auto end = placeIn(words);
    return control_.arc({end[0], end[1]}, {value('I'), value('J')}, value('F'), codes.contains(2));
  }
  if (guarded && words.contains('C')) return control_.turnUntilTouched(value('C') + shiftOf(5), value('F'));
  if (!words.contains('X')) return turnBy(words, value('F'));
  const auto to = placeIn(words);
  guarded ? control_.seek(to, value('F')) : control_.move(to, value('F'), false);
}

// As many a builder's M6 does: it is a macro that leaves its own modes.
void FanucProgram::takeTool(unsigned number) {
  control_.takeTool(number);
  modal[4002] = 18;
  modal[4003] = 91;
  modal[4005] = 95;
  modal[4008] = 43;
  modal[4014] = 54;
}

// Station and offset. The offset of a tool is taken as a shift, without a move.
void FanucProgram::turnTurret(unsigned word) {
  control_.takeTool(word / 100);
  tool_offset = word % 100;
  commanded_tool.reset();
  modal[4005] = 99;
  modal[4014] = 54;
}

// An axis that has no word, or that the control does not have, stays.
std::array<double, 3> FanucProgram::placeIn(const std::map<char, std::string>& words) {
  std::array<double, 3> to{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char letter = "XYZ"[axis];
    const auto word = words.find(letter);
    if (word != words.end() && letters_.find(letter) == std::string::npos)
      throw Alarm{std::string{"no axis "} + letter + " here"};
    to.at(axis) =
        word == words.end() ? control_.position(letter) : outOfWords(letter, valueOf(word->second)) + shiftOf(axis);
  }
  return to;
}

}  // namespace probebox::scenario
