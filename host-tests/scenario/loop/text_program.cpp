#include "text_program.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

namespace probebox::scenario {
namespace {

bool begins(const std::string& text, std::string_view with) {
  return text.starts_with(with);
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// As SiemensWriter names it.
std::string siemensName(const std::string& of) {
  std::string name = upper(of.starts_with("_pb_") ? "pbv_" + of.substr(4) : "pbl_" + of);
  std::ranges::replace(name, '/', '_');
  return name;
}

// Words of a block: letter and text up to the next word; "X=" of Siemens counts as X.
std::map<char, std::string> wordsOf(const std::string& text) {
  std::map<char, std::string> words;
  std::istringstream all{text};
  for (std::string word; all >> word;) {
    const std::size_t from = word.size() > 1 && word[1] == '=' ? 2 : 1;
    if (word[0] == 'G' && words.contains('G')) continue;  // G153
    words[word[0]] = word.substr(from);
  }
  return words;
}

// The words that begin with G, without it.
std::vector<std::string> codesOf(const std::string& text) {
  std::vector<std::string> codes;
  std::istringstream all{text};
  for (std::string word; all >> word;) {
    if (word[0] == 'G') codes.push_back(word.substr(1));
  }
  return codes;
}

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

FanucProgram::FanucProgram(Control& control, std::string_view text) : TextProgram{control} {
  known_ = [this](const std::string&, double index) { return read(static_cast<int>(std::lround(index))); };
  std::istringstream all{std::string{text}};
  std::string name;
  for (std::string one; std::getline(all, one);) {
    if (one == "%") continue;
    if (begins(one, "O")) {
      name = one.substr(1, one.find(' ') - 1);
      if (first_.empty()) first_ = name;
      continue;
    }
    if (begins(name, first_.substr(0, 2)) && name.ends_with("49") && begins(one, "(#")) {
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
  if (number >= 5021 && number <= 5026) return control_.position("XYZABC"[number - 5021]);
  if (number >= 5041 && number <= 5046) {
    const auto axis = static_cast<std::size_t>(number - 5041);
    return control_.position("XYZABC"[axis]) - shiftOf(axis) + missed_mm_;
  }
  if (number >= 5221 && number <= 5326)
    return offsets.at(54 + (number - 5221) / 20).at(static_cast<std::size_t>((number - 5221) % 20));
  if (const auto found = modal.find(number); found != modal.end()) return found->second;
  if (number == 4120) return commanded_tool ? *commanded_tool : control_.tool();
  if (number == kToolOfTheBuilder) return control_.tool();
  if (number == 1033)
    return static_cast<std::int32_t>(control_.plc().answer(static_cast<std::uint32_t>(variables_[1133])));
  if (number >= 1000 && number != 1133) throw Alarm{"no variable #" + std::to_string(number)};
  return variables_[number];
}

double FanucProgram::shiftOf(std::size_t axis) const {
  const double length_mm = axis == 2 && modal.at(4008) == 43 ? length : 0;
  return offsets.at(static_cast<int>(modal.at(4014))).at(axis) + local.at(axis) + length_mm;
}

double FanucProgram::get(const std::string& name) const {
  const auto found = variables_.find(numbers_.at(upper(name)));
  return found == variables_.end() ? 0 : found->second;
}

void FanucProgram::write(int number, double value) {
  if (number == 3000) throw Alarm{"#3000 " + last};
  if (number > 999 && number != 1133) throw Alarm{"no variable #" + std::to_string(number)};
  for (const auto& [name, preset] : preset_) {
    if (numbers_.at(upper(name)) == number) value = preset;
  }
  if (const auto preset = preset_table_.find(number + 300); preset != preset_table_.end() && number >= 700)
    value = preset->second;
  variables_[number] = value;
}

std::string FanucProgram::line(const std::string& text) {
  if (text == "M99") return "return";
  if (begins(text, "GOTO ")) return "->" + text.substr(5);
  if (begins(text, "IF [")) {
    const auto then = text.rfind("] THEN ");
    if (then != std::string::npos) return holds(text.substr(4, then - 4), known_) ? line(text.substr(then + 7)) : "";
    const auto end = text.rfind("] GOTO ");
    return holds(text.substr(4, end - 4), known_) ? "->" + text.substr(end + 7) : "";
  }
  if (begins(text, "#3006=1 (")) {
    control_.said = text.substr(9, text.size() - 10);
    if (control_.said.size() > 26) throw Alarm{"a message that is not shown as a whole: " + text};
    control_.stop();
    return {};
  }
  if (begins(text, "M98 P")) {
    run(text.substr(5));
    return {};
  }
  if (text.front() == '#') {
    const auto equals = text.find('=');
    const auto end = begins(text, "#3000") ? text.find(' ') : text.size();
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
  if (begins(text, "T")) return takeTool(static_cast<unsigned>(value('T')));
  std::set<double> codes;
  for (const auto& code : codesOf(text)) codes.insert(valueOf(code));
  if (codes.contains(4)) return control_.wait(value('P') / 1000);
  // With parameter 5006 bit 6 (TOS) = 0.
  const bool in_machine_frame = codes.contains(53) && words.contains('Z');
  if (codes.contains(49) && modal[4008] != 49 && !in_machine_frame) throw Alarm{"G49 moves Z by the tool's length"};
  if (in_machine_frame && std::abs(value('Z') - control_.position('Z')) > 1e-6) throw Alarm{"G53 moves Z"};
  for (const double code : codes) {
    if (const int group = groupOf(code); group != 0) modal[group] = code;
  }
  if (codes.contains(10)) {
    for (std::size_t axis = 0; axis < 6; ++axis) {
      if (words.contains("XYZABC"[axis]))
        offsets.at(53 + static_cast<int>(value('P'))).at(axis) = value("XYZABC"[axis]);
    }
    return;
  }
  const bool guarded = codes.contains(31), round = codes.contains(2) || codes.contains(3);
  if (!guarded && !round && !codes.contains(1) && !(codes.contains(0) && !in_machine_frame)) {
    if (codes.empty()) throw Alarm{"an unknown block: " + text};
    return;
  }
  for (const auto& [group, needed] : {std::pair{4003, 90}, {4005, 94}, {4006, 21}}) {
    if (modal[group] != needed) throw Alarm{"a move without G" + std::to_string(needed)};
  }
  if (codes.contains(0)) return turnBy(words);
  if (round) {
    if (modal[4002] != 17) throw Alarm{"an arc in another plane than G17"};
    return control_.arc({value('X') + shiftOf(0), value('Y') + shiftOf(1)}, {value('I'), value('J')}, value('F'),
                        codes.contains(2));
  }
  if (guarded && words.contains('C')) return control_.turnUntilTouched(value('C') + shiftOf(5), value('F'));
  if (!words.contains('X')) return turnBy(words, value('F'));
  missed_mm_ = 0;
  try {
    control_.move({value('X') + shiftOf(0), value('Y') + shiftOf(1), value('Z') + shiftOf(2)}, value('F'), guarded);
  } catch (const Touched&) {
    missed_mm_ = 1;
  }
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

SiemensProgram::SiemensProgram(Control& control, std::string_view text) : TextProgram{control} {
  known_ = [this](const std::string& name, double index) { return read(name, index); };
  std::istringstream all{std::string{text}};
  std::string name;
  for (std::string one; std::getline(all, one);) {
    if (begins(one, "%_N_")) {
      name = one.substr(4, one.rfind('_') - 4);
    } else if (begins(one, "DEF CHAN REAL ")) {
      variables_[one.substr(14)] = 0;
    } else if (begins(one, "DEF CHAN INT ")) {
      whole_.insert(one.substr(13));
      variables_[one.substr(13)] = 0;
    } else if (begins(one, "PROC PROBEBOX(")) {
      saves_ = one.ends_with(" SAVE");
      for (auto at = one.find("PBP_"); at != std::string::npos; at = one.find("PBP_", at + 1))
        parameters_.push_back(one.substr(at, one.find_first_of(",)", at) - at));
    } else if (!one.empty() && one.front() != ';' && !begins(one, "PROC ")) {
      programs_[name].push_back(one);
    }
  }
}

void SiemensProgram::call(const std::vector<double>& arguments) {
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    variables_[parameters_[i]] = i < arguments.size() ? arguments[i] : 0;
  const auto before = modes;
  run("PROBEBOX");
  if (!saves_) return;
  const double d = modes.at('D');
  modes = before;
  modes['D'] = d;
}

double SiemensProgram::read(const std::string& name, double index) {
  const auto word = [&](double at) { return control_.plc().word(static_cast<std::size_t>(at) / 2); };
  const auto both = [&] { return std::uint32_t{word(index)} << 16U | word(index + 2); };
  if (begins(name, "$A_DB") && std::fmod(index, name == "$A_DBW" ? 2 : 4) != 0) throw Alarm{"an odd place of " + name};
  if (name == "$A_DBW") return static_cast<std::int16_t>(word(index));
  if (name == "$A_DBD") return static_cast<std::int32_t>(both());
  if (name == "$A_DBR") return std::bit_cast<float>(both());
  if (begins(name, "$AA_IM")) return control_.position(name.back());
  if (name == "$AC_MEA") return touched_;
  if (name == "$P_TOOLNO") return control_.tool();
  if (name == "$P_TOOL") return modes.at('D');
  if (name == "$AC_TRAFO") return transformation;
  if (name == "PBT_N" && index != std::floor(index)) throw Alarm{"an index that is no integer"};
  if (name == "PBT_N") return table_[static_cast<int>(index)];
  const auto found = variables_.find(name);
  if (found == variables_.end()) throw Alarm{"not defined: " + name};
  return found->second;
}

double SiemensProgram::get(const std::string& name) const {
  return variables_.at(siemensName(name));
}

void SiemensProgram::write(const std::string& target, double value) {
  const auto bracket = target.find('[');
  const auto name = target.substr(0, bracket);
  if (bracket == std::string::npos) {
    if (!variables_.contains(name)) throw Alarm{"not defined: " + name};
    if (name.size() > 31) throw Alarm{"too long: " + name};
    const auto preset = std::ranges::find_if(preset_, [&](const auto& one) { return siemensName(one.first) == name; });
    variables_[name] = preset != preset_.end() ? preset->second : whole_.contains(name) ? std::round(value) : value;
    return;
  }
  const double index = valueOf(target.substr(bracket + 1, target.size() - bracket - 2));
  if (name == "PBT_N") {
    const auto preset = preset_table_.find(static_cast<int>(index) + 1000);
    table_[static_cast<int>(index)] = preset == preset_table_.end() ? value : preset->second;
    return;
  }
  const auto at = static_cast<std::size_t>(index) / 2;
  if (name == "$A_DBW") {
    if (value < -32768 || value > 32767) throw Alarm{"beyond 16 bits: " + target};
    return control_.plc().set(at, static_cast<std::uint16_t>(value));
  }
  if (name != "$A_DBD" || std::fmod(index, 4) != 0) throw Alarm{"nothing to assign to: " + target};
  const auto all = static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
  control_.plc().set(at, static_cast<std::uint16_t>(all >> 16U));
  control_.plc().set(at + 1, static_cast<std::uint16_t>(all));
}

std::string SiemensProgram::line(const std::string& text) {
  if (text == "M17") return "return";
  if (text.back() == ':') return {};
  if (begins(text, "MSG(")) {
    control_.said = text.substr(5, text.size() - 7);
    return {};
  }
  if (begins(text, "GOTO ")) return "->" + text.substr(5);
  if (begins(text, "IF ")) {
    const auto end = text.rfind(" GOTO ");
    return holds(text.substr(3, end - 3), known_) ? "->" + text.substr(end + 6) : "";
  }
  if (begins(text, "SETAL(")) throw Alarm{last};
  if (programs_.contains(text)) {
    run(text);
    return {};
  }
  const auto equals = text.find('=');
  if (begins(text, "PB") || begins(text, "$A_DB")) {
    write(text.substr(0, equals), valueOf(text.substr(equals + 1)));
    return {};
  }
  block(text);
  return {};
}

void SiemensProgram::block(const std::string& text) {
  const bool guarded = begins(text, "MEAS=1 ");
  auto words = wordsOf(guarded ? text.substr(7) : text);
  const auto value = [&](char letter) { return valueOf(words[letter]); };
  if (text == "STOPRE" || text == "TRAFOOF") return control_.wait(0.004);
  if (begins(text, "G4 ")) return control_.wait(value('F'));
  if (text == "M0") return control_.stop();
  if (begins(text, "T=")) return control_.takeTool(static_cast<unsigned>(value('T')));
  if (text == "M6") {
    // As many a builder's M6 does: it is a program that leaves its own modes.
    modes = {{'P', 18}, {'U', 70}, {'A', 91}, {'F', 95}, {'S', 64}, {'D', 1}};
    return;
  }
  if (begins(text, "D")) {
    modes['D'] = value('D');
    return;
  }
  const bool round = begins(text, "G2 G153 ") || begins(text, "G3 G153 ");
  const bool moves = guarded || round || begins(text, "G1 G153 ");
  if (moves || begins(text, "G0 G153 ")) {
    if (modes['A'] != 90) throw Alarm{"a move that is incremental"};
    if (modes['U'] != 710 || (moves && modes['F'] != 94)) throw Alarm{"a feed that is not mm/min"};
    if (modes['D'] != 0) throw Alarm{"a move with a tool length"};
    if (!moves) return turnBy(words);
    if (round && modes['P'] != 17) throw Alarm{"an arc in another plane than G17"};
    if (round) return control_.arc({value('X'), value('Y')}, {value('I'), value('J')}, value('F'), begins(text, "G2"));
    if (guarded && words.contains('C')) return control_.turnUntilTouched(value('C'), value('F'));
    if (!words.contains('X')) return turnBy(words, value('F'));
    touched_ = 0;
    try {
      control_.move({value('X'), value('Y'), value('Z')}, value('F'), guarded);
    } catch (const Touched&) {
      touched_ = 1;
    }
    return;
  }
  const auto codes = codesOf(text);
  if (codes.empty()) throw Alarm{"an unknown block: " + text};
  for (const auto& code : codes) {
    const int g = std::stoi(code);
    if (g >= 17 && g <= 19) {
      modes['P'] = g;
    } else if (g == 70 || g == 71 || g == 700 || g == 710) {
      modes['U'] = g;
    } else if (g == 90 || g == 91) {
      modes['A'] = g;
    } else if (g == 94 || g == 95) {
      modes['F'] = g;
    } else if (g == 60 || g == 64) {
      modes['S'] = g;
    } else if (g != 40) {
      throw Alarm{"an unknown block: " + text};
    }
  }
}

}  // namespace probebox::scenario
