#include <algorithm>
#include <bit>
#include <cmath>

#include "block_words.hpp"
#include "text_program.hpp"

namespace probebox::scenario {
namespace {

// As SiemensWriter names it.
std::string siemensName(const std::string& of) {
  return upper(of.starts_with("_pb_") ? "pbv_" + of.substr(4) : of);
}

}  // namespace

SiemensProgram::SiemensProgram(Control& control, std::string_view text, bool has_y, bool is_lathe)
    : TextProgram{control}, has_y_{has_y}, is_lathe_{is_lathe} {
  if (is_lathe_) modes['R'] = 1;
  known_ = [this](const std::string& name, double index) { return read(name, index); };
  std::istringstream all{std::string{text}};
  std::string name;
  for (std::string one; std::getline(all, one);) {
    if (one.starts_with("%_N_")) {
      name = one.substr(4, one.rfind('_') - 4);
    } else if (one.starts_with("; PBL_N[")) {
      numbers_[one.substr(one.find("] ") + 2)] = std::stoi(one.substr(8));
    } else if (one.starts_with("DEF CHAN REAL PBL_N[")) {
      locals_.resize(static_cast<std::size_t>(std::stoi(one.substr(20))));
    } else if (one.starts_with("DEF CHAN REAL ")) {
      variables_[one.substr(14)] = 0;
    } else if (one.starts_with("DEF CHAN INT ")) {
      whole_.insert(one.substr(13));
      variables_[one.substr(13)] = 0;
    } else if (one.starts_with("PROC PROBEBOX(")) {
      saves_ = one.ends_with(" SAVE");
      for (auto at = one.find("PBP_"); at != std::string::npos; at = one.find("PBP_", at + 1))
        parameters_.push_back(one.substr(at, one.find_first_of(",)", at) - at));
    } else if (!one.empty() && one.front() != ';' && !one.starts_with("PROC ")) {
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
  if (name.starts_with("$A_DB") && std::fmod(index, name == "$A_DBW" ? 2 : 4) != 0)
    throw Alarm{"an odd place of " + name};
  if (name == "$A_DBW") return static_cast<std::int16_t>(word(index));
  if (name == "$A_DBD") return static_cast<std::int32_t>(both());
  if (name == "$A_DBR") return std::bit_cast<float>(both());
  if (name.starts_with("$AA_IM")) return control_.position(name.back());
  if (name == "$AC_MEA") return touched_;
  if (name == "$P_TOOLNO") return control_.tool();
  if (name == "$P_TOOL") return modes.at('D');
  if (name == "$AC_TRAFO") return transformation;
  if (name == "PBT_N" && index != std::floor(index)) throw Alarm{"an index that is no integer"};
  if (name == "PBT_N") return table_[static_cast<int>(index)];
  if (name == "PBL_N") return locals_.at(static_cast<std::size_t>(index));
  const auto found = variables_.find(name);
  if (found == variables_.end()) throw Alarm{"not defined: " + name};
  return found->second;
}

double SiemensProgram::get(const std::string& name) const {
  const auto found = variables_.find(siemensName(name));
  return found != variables_.end() ? found->second : locals_.at(static_cast<std::size_t>(numbers_.at(upper(name))));
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
  if (name == "PBL_N") {
    locals_.at(static_cast<std::size_t>(index)) = value;
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
  if (text.starts_with("MSG(")) {
    control_.said = text.substr(5, text.size() - 7);
    return {};
  }
  if (text.starts_with("GOTO ")) return "->" + text.substr(5);
  if (text.starts_with("IF ")) {
    const auto end = text.rfind(" GOTO ");
    return holds(text.substr(3, end - 3), known_) ? "->" + text.substr(end + 6) : "";
  }
  if (text.starts_with("SETAL(")) throw Alarm{last};
  if (programs_.contains(text)) {
    run(text);
    return {};
  }
  const auto equals = text.find('=');
  if (text.starts_with("PB") || text.starts_with("$A_DB")) {
    write(text.substr(0, equals), valueOf(text.substr(equals + 1)));
    return {};
  }
  block(text);
  return {};
}

void SiemensProgram::block(const std::string& text) {
  const bool guarded = text.starts_with("MEAS=1 ");
  auto words = wordsOf(guarded ? text.substr(7) : text);
  const auto value = [&](char letter) { return valueOf(words[letter]); };
  if (text == "STOPRE" || text == "TRAFOOF") return control_.wait(0.004);
  if (text.starts_with("G4 ")) return control_.wait(value('F'));
  if (text == "M0") return control_.stop();
  if (text == "M9") return control_.endCoolant();
  if (text == "SPOS=0") return control_.orient();
  if (text == "DIAMOF" && is_lathe_) {
    modes['R'] = 0;
    return;
  }
  if (text.starts_with("T=")) {
    control_.takeTool(static_cast<unsigned>(value('T')));
    if (is_lathe_) modes['D'] = 1;  // its cutting edge, by the machine data
    return;
  }
  if (text == "M6" && !is_lathe_) {
    // As many a builder's M6 does: it is a program that leaves its own modes.
    modes = {{'P', 18}, {'U', 70}, {'A', 91}, {'F', 95}, {'S', 64}, {'D', 1}};
    return;
  }
  if (text.starts_with("D")) {
    modes['D'] = value('D');
    return;
  }
  const bool round = text.starts_with("G2 G153 ") || text.starts_with("G3 G153 ");
  const bool moves = guarded || round || text.starts_with("G1 G153 ");
  if (moves || text.starts_with("G0 G153 ")) {
    if (modes['A'] != 90) throw Alarm{"a move that is incremental"};
    if (modes['U'] != 710 || (moves && modes['F'] != 94)) throw Alarm{"a feed that is not mm/min"};
    if (modes['D'] != 0) throw Alarm{"a move with a tool length"};
    if (!moves) return turnBy(words);
    if (round && modes['P'] != 17) throw Alarm{"an arc in another plane than G17"};
    const double in_diameters = is_lathe_ && modes['R'] == 1 ? 2 : 1;
    if (round)
      return control_.arc({value('X') / in_diameters, value('Y')}, {value('I'), value('J')}, value('F'),
                          text.starts_with("G2"));
    if (guarded && words.contains('C')) return control_.turnUntilTouched(value('C'), value('F'));
    if (!words.contains('X')) return turnBy(words, value('F'));
    if (words.contains('Y') != has_y_) throw Alarm{"a word of an axis that is not there, or none of one: " + text};
    const double x = value('X') / in_diameters, y = has_y_ ? value('Y') : control_.position('Y');
    touched_ = 0;
    try {
      control_.move({x, y, value('Z')}, value('F'), guarded);
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
