#include "interpreter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <sstream>
#include <utility>

namespace probebox {
namespace {

using Words = std::map<char, double>;

struct Codes {
  std::vector<double> g, m;
  Words words;

  bool has(double code) const { return std::ranges::find(g, code) != g.end(); }
  bool hasM(double code) const { return std::ranges::find(m, code) != m.end(); }
  bool moves(const char* letters) const {
    return std::ranges::any_of(
        words, [&](const auto& word) { return std::string_view{letters}.find(word.first) != std::string_view::npos; });
  }
};

class Control {
 public:
  explicit Control(Machine machine) : machine_{machine}, absolute_{hasSystemA()} {}
  void take(const std::string& raw) {
    line_ = raw;
    if (subroutine(raw) || printed(raw) || raw.empty() || raw == "%" || raw == ";" || raw[0] == ';' || raw[0] == '%')
      return;
    if (stopped(raw) || checked(raw) || passed(raw)) return;
    block(raw);
  }
  Interpreted done() {
    if (!unchecked_.empty()) danger("no alarm follows " + unchecked_);
    return std::move(all_);
  }

 private:
  bool isLathe() const { return machine_ != Machine::mill; }
  bool hasSystemA() const { return machine_ == Machine::system_a; }
  double radius(double word) const { return hasSystemA() || (isLathe() && !radius_) ? word / 2 : word; }
  Part& part() { return all_.parts.back(); }
  void danger(const std::string& what) { all_.dangers.push_back(what + ": " + line_); }

  bool subroutine(const std::string& raw) {
    static const std::regex kWord{R"(o<(\w+)> (sub|endsub|call|if .*|endif))"};
    std::smatch found;
    if (!std::regex_match(raw, found, kWord)) {
      if (!in_.empty()) subroutines_[in_] += raw + "\n";
      return !in_.empty();
    }
    linuxcnc_ = true;
    const std::string name = found[1], word = found[2];
    if (word == "sub") {
      in_ = name;
    } else if (word == "endsub") {
      in_.clear();
    } else if (!in_.empty()) {
      subroutines_[in_] += raw + "\n";
    } else if (word == "call") {
      call(subroutines_[name]);
    }
    return true;
  }

  void call(const std::string& body) {
    const bool aborts = body.find("(ABORT,") != std::string::npos;
    if (aborts && body.find("[#5070 EQ 1]") != std::string::npos) unchecked_.clear();
    if (aborts && body.find("#<_tool_offset> EQ 0") != std::string::npos) offset_ = true;
  }

  // A line for the box, by DPRNT from variables, by WRITE or by LOG as it is.
  bool printed(const std::string& raw) {
    static const std::regex kLine{R"re(DPRNT\[(.*)\]|WRITE\(PB_ERR,"/dev/v24","(.*)"\)|\(LOG,(.*)\))re"};
    std::smatch found;
    if (!std::regex_match(raw, found, kLine)) return false;
    std::string text = found[1].matched ? found[1] : found[2].matched ? found[2] : found[3];
    static const std::regex kVariable{R"(#(\d+)\[\d\d\])"};
    for (std::smatch variable; std::regex_search(text, variable, kVariable);)
      text = variable.prefix().str() + std::to_string(variables_.at(std::stoi(variable[1]))) + variable.suffix().str();
    static const std::regex kMark{R"((BEGIN|END)([\d.]+)[* ]A(\S+?)[* ]B(\S+?)[* ]C(\S+?)[* ]T(\S+?)[* ]F(\S+))"};
    std::smatch mark;
    if (!std::regex_match(text, mark, kMark)) {
      all_.unknown.push_back(raw);
      return true;
    }
    part().marks.push_back({mark[1] == "BEGIN",
                            static_cast<std::size_t>(std::stod(mark[2])),
                            {std::stod(mark[3]), std::stod(mark[4]), std::stod(mark[5])},
                            std::stod(mark[7]),
                            part().moves.size()});
    return true;
  }

  // With a message that the operator sees.
  bool stopped(const std::string& raw) {
    static const std::regex kMessage{R"re(#3006=1\((.*)\)|MSG\("([^"]+)"\)|\(MSG,(.*)\))re"};
    std::smatch found;
    if (std::regex_match(raw, found, kMessage)) {
      message_ = found[1].matched ? found[1] : found[2].matched ? found[2] : found[3];
      if (found[1].matched) stop();
      return true;
    }
    if (raw != "M0") return false;
    stop();
    return true;
  }
  void stop() {
    if (message_.empty()) danger("a stop that says nothing");
    all_.messages.push_back(message_);
    message_.clear();
    all_.parts.emplace_back();
  }

  // Alarms that end the program where something is not as it should be.
  bool checked(const std::string& raw) {
    static const std::regex kOffset{R"(IF\[#4008NE43\]THEN#3000=1\(.*\)|IF \(\$P_TOOL==0\) OR .*)"};
    static const std::regex kOffsetOfT{R"(IF\[\[#4120-100\*FIX\[#4120/100\]\]EQ0\]THEN#3000=1\(.*\))"};
    if (std::regex_match(raw, hasSystemA() ? kOffsetOfT : kOffset)) {
      offset_ = true;
      return true;
    }
    static const std::regex kDifference{
        R"(#7=ABS\[#5061-\[(.*?)\]\]\+ABS\[#5062-\[(.*?)\]\]\+ABS\[#5063-\[(.*?)\]-#8\])"};
    static const std::regex kDifferenceOfTwo{R"(#7=ABS\[#5061-\[(.*?)\]\]\+ABS\[#5062-\[(.*?)\]-#8\])"};
    std::smatch from;
    if (std::regex_match(raw, from, hasSystemA() ? kDifferenceOfTwo : kDifference)) {
      for (std::size_t axis = 0; axis + 1 < from.size(); ++axis) {
        const std::size_t named = hasSystemA() && axis == 1 ? 2 : axis;
        const double mm = named == 0 ? radius(std::stod(from[1])) : std::stod(from[axis + 1]);
        if (std::abs(now_.at_mm[named] - mm) > 1e-9) danger("compared with another place");
      }
      compared_ = true;
      return true;
    }
    if (raw.starts_with("IF[#7GT0.1]THEN#3000=") && compared_ && frame_known_) {
      unchecked_.clear();
      compared_ = false;
    }
    if (raw == "IF $AC_MEA[1]==1 GOTOF PB_TOUCHED") unchecked_.clear();
    if (raw == "IF $AC_MEA[1]==0 GOTOF PB_NOTHING") sought();
    if (raw == "IF[#7LT0.02]THEN#3000=4(NOTHING TOUCHED)" && compared_ && frame_known_) sought();
    static const std::regex kFrame{R"(#8=#5043-\[(.*)\])"}, kFrameOfTwo{R"(#8=#5042-\[(.*)\])"};
    if (std::regex_match(raw, from, hasSystemA() ? kFrameOfTwo : kFrame)) {
      frame_known_ = std::abs(std::stod(from[1]) - now_.at_mm[2]) < 1e-9;
      return true;
    }
    return raw.starts_with("IF[") || raw.starts_with("IF ");
  }

  bool passed(const std::string& raw) {
    static const std::regex kPassed{
        R"(POPEN|PCLOS|STOPRE|TRANS|MSG\(\)|DEF INT PB_ERR|EXTOPEN\(PB_ERR,"[^"]*","SYN","EXCL","APP"\)|EXTCLOSE\(PB_ERR,"[^"]*"\)|SETAL\(6500\d(,".*")?\)|ENDIF|PB_TOUCHED:|PB_NOTHING:|\(.*\))"};
    if (std::regex_match(raw, kPassed)) return true;
    static const std::regex kAssignment{R"(#(\d+)=(-?[\d.]+))"};
    std::smatch parts;
    if (std::regex_match(raw, parts, kAssignment)) {
      const int variable = std::stoi(parts[1]);
      if (variable > 33) danger("a common variable is overwritten");
      variables_[variable] = std::stod(parts[2]);
      return true;
    }
    if (raw == "DIAMOF" && machine_ == Machine::siemens_lathe) return radius_ = true;
    if (raw == "TRAORI" || raw == "TRAFOOF") tip_control_ = raw == "TRAORI";
    static const std::regex kOrientation{R"((?:SPOS=|M19 R)(\d+\.\d+)(?: Q20)?)"};
    if (std::regex_match(raw, parts, kOrientation)) {
      now_.angles_deg[0] = std::stod(parts[1]);
      ++all_.orientations;
      return true;
    }
    return tip_control_ ? raw == "TRAORI" : raw == "TRAFOOF";
  }

  void block(const std::string& raw) {
    std::string text = std::regex_replace(raw, std::regex{R"(\([^()]*\))"}, "");
    const bool measures = text.starts_with("MEAS=1 ");
    if (measures) text = text.substr(7);
    const auto supa = text.find("SUPA ");
    if (supa != std::string::npos) text.erase(supa, 5);
    static const std::regex kWord{R"(([A-Z])(-?\d+\.?\d*))"};
    Codes codes;
    for (std::sregex_iterator word{text.begin(), text.end(), kWord}, end; word != end; ++word) {
      const char letter = (*word)[1].str()[0];
      const double value = std::stod((*word)[2]);
      if (letter == 'G') {
        codes.g.push_back(value);
      } else if (letter == 'M') {
        codes.m.push_back(value);
      } else {
        codes.words[letter] = value;
      }
    }
    if (std::regex_replace(text, kWord, "").find_first_not_of(' ') != std::string::npos) all_.unknown.push_back(raw);
    modes(codes);
    tools(codes);
    if (isLathe()) lathe(codes);
    if (hasSystemA() && codes.has(28)) return reference(codes);
    if (codes.has(53) || supa != std::string::npos) return retract(codes);
    motion(codes, measures);
  }

  // What no lathe of this kind takes, and increments by U and W in place of G91.
  void lathe(const Codes& codes) {
    for (const double code : {43.0, 43.4, 49.0}) {
      if (codes.has(code)) danger("a length offset of a mill");
    }
    for (const double code : {90.0, 91.0, 92.0, 94.0, 95.0}) {
      if (hasSystemA() && codes.has(code)) danger("a cycle");
    }
    if (codes.moves("YAB") || codes.hasM(6) || codes.hasM(19)) danger("no word of a lathe of X and Z");
    const bool increments = codes.moves("UW") && !codes.has(28);
    if (increments && (codes.moves("XZ") || !hasSystemA() || !at_contact_)) danger("an increment from elsewhere");
  }

  // Z first, away from everything.
  void reference(const Codes& codes) {
    const bool z = codes.words.contains('W'), x = codes.words.contains('U');
    if (codes.moves("XZ") || z == x || codes.words.begin()->second != 0)
      danger("no way straight to the reference point");
    if (x && !retracted_) danger("X goes to the reference point before Z");
    if (z) part().retracts.push_back(part().moves.size());
    if (z) retracted_ = true;
    height_known_ = false;
  }

  void modes(const Codes& codes) {
    if (codes.has(21) || codes.has(710)) millimetres_ = true;
    if (codes.has(20) || codes.has(70) || codes.has(700) || codes.has(71)) millimetres_ = false;
    if (codes.has(90)) absolute_ = true;
    if (codes.has(91)) absolute_ = false;
    for (const double plane : {17.0, 18.0, 19.0}) {
      if (codes.has(plane)) plane_ = plane == (isLathe() ? 18 : 17);
    }
    if (codes.has(54)) work_offset_ = true;
    if (codes.has(hasSystemA() ? 98 : 94)) feed_per_minute_ = true;
    if (codes.has(93) || codes.has(95) || (hasSystemA() && codes.has(99))) feed_per_minute_ = false;
    if (codes.has(4)) part().dwells.push_back(part().moves.size());
    if (codes.hasM(9)) coolant_off_ = true;
    if (codes.hasM(5)) spindle_stands_ = true;
    if (codes.hasM(2) || codes.hasM(30)) all_.ended = true;
    for (const double code : codes.g) {
      if (code < 4) motion_ = code;
      if (code == 31 || code == 38.2 || code == 38.3) motion_ = 1;
    }
  }

  void tools(const Codes& codes) {
    if (codes.words.contains('T')) tool_ = codes.words.at('T');
    if (codes.hasM(6) || (isLathe() && codes.words.contains('T'))) {
      if (!retracted_) danger("a tool is taken before Z is retracted");
      part().tools.push_back(part().moves.size());
      // A builder's macro may leave any of these as it needed them: G91 G30 Z0 is a usual one.
      offset_ = millimetres_ = absolute_ = plane_ = work_offset_ = feed_per_minute_ = radius_ = false;
      // Station and offset in one word.
      offset_ = hasSystemA() && tool_ > 100 && tool_ == 101 * std::floor(tool_ / 101);
      absolute_ = hasSystemA();
    }
    if (codes.words.contains('D')) offset_ = codes.words.at('D') != 0;
    if (codes.has(49)) {
      if (!codes.has(53) || !codes.moves("Z")) danger("G49 moves Z by the tool's length");
      offset_ = tip_control_ = false;
    }
    for (const double code : {43.0, 43.4, 234.0}) {
      if (!codes.has(code)) continue;
      if (codes.words.at('H') != tool_) danger("the offset is another tool's");
      if (!linuxcnc_ && !codes.moves("Z")) danger("an offset without a move of Z");
      offset_ = true;
      tip_control_ = code != 43;
    }
  }

  void retract(const Codes& codes) {
    if (!codes.moves("XYZABC")) return;
    if (codes.moves("XYABC")) danger("more than Z in machine coordinates");
    if (tip_control_) danger("tip control is active while Z is retracted");
    part().retracts.push_back(part().moves.size());
    retracted_ = true;
    height_known_ = false;
  }

  void motion(const Codes& codes, bool measures) {
    if (codes.has(52)) return;  // shifts, and moves nothing
    const bool linear = codes.moves("XYZUW"), rotary = codes.moves("ABC");
    if (!linear && !rotary) return;
    if (!millimetres_ || !(absolute_ || (at_contact_ && linear))) danger("units or absolute positions are not set");
    if (!plane_ || !work_offset_ || !feed_per_minute_) danger("plane, work offset or feed per minute are not set");
    if (!spindle_stands_) danger("the spindle was not stopped");
    if (!coolant_off_) danger("the coolant was not stopped");
    if (!unchecked_.empty()) danger("no alarm follows " + unchecked_);
    if (motion_ == 0 && linear) danger("a rapid of a linear axis");
    if (motion_ == 0 && tip_control_) danger("a rapid carries linear axes under tip control");
    if (machine_ == Machine::siemens_lathe && !radius_) danger("X moves in diameters");
    const char* offset = isLathe() ? "XZUW" : "Z";  // a tool of a lathe is long along X too
    if (codes.moves(offset) && !offset_) danger("a move without the offset of a tool");
    if (linear && !codes.moves("ZW") && !retracted_ && !height_known_) danger("X and Y move at an unknown height");
    if (linear) go(codes, measures);
    if (!rotary) return;
    for (const auto& [letter, value] : codes.words) {
      if (letter >= 'A' && letter <= 'C') now_.angles_deg[static_cast<std::size_t>(letter - 'A')] = value;
    }
    part().turns.push_back({now_.angles_deg, part().moves.size(), now_.at_mm[2], tip_control_});
  }

  // The last move has looked for a surface, and the emulated one is at its nominal place. It and the way off the
  // contact are no moves of the path.
  void sought() {
    const auto from = part().moves.at(part().moves.size() - 2).at_mm, to = part().moves.back().at_mm;
    part().moves.pop_back();
    ++part().seeks;
    unchecked_.clear();
    compared_ = false;
    double length_mm = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) length_mm += (from[axis] - to[axis]) * (from[axis] - to[axis]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      now_.at_mm[axis] = to[axis] + kSought_mm / std::sqrt(length_mm) * (from[axis] - to[axis]);
    at_contact_ = leaves_contact_ = true;
  }

  void go(const Codes& codes, bool measures) {
    const std::array before_mm{now_.at_mm[0], now_.at_mm[1]};
    bool increments = !absolute_;
    for (const auto& [letter, value] : codes.words) {
      const bool by = letter == 'U' || letter == 'W';
      const char axis = letter == 'U' ? 'X' : letter == 'W' ? 'Z' : letter;
      if (axis >= 'X' && axis <= 'Z') {
        double& at_mm = now_.at_mm[static_cast<std::size_t>(axis - 'X')];
        const double mm = axis == 'X' ? radius(value) : value;
        at_mm = absolute_ && !by ? mm : at_mm + mm;
        increments = increments || by;
      }
      if (letter == 'F') now_.feed_mm_min = value;
    }
    if (std::exchange(leaves_contact_, false)) return;
    now_.placed = now_.placed || codes.moves("X");
    now_.at_machine_height = retracted_ && !codes.moves("ZW");
    if (codes.moves("ZW")) {
      retracted_ = false;
      height_known_ = true;
    }
    now_.guarded = measures || codes.has(31) || codes.has(38.3);
    if (now_.guarded && !codes.hasM(78)) unchecked_ = line_;
    if (!increments) at_contact_ = false;
    now_.arc = motion_ >= 2 ? static_cast<int>(motion_) : 0;
    if (now_.arc != 0) now_.centre_mm = {before_mm[0] + codes.words.at('I'), before_mm[1] + codes.words.at('J')};
    part().moves.push_back(now_);
    if (codes.hasM(79) || codes.has(38.2)) sought();
  }

  Machine machine_;
  bool absolute_;
  bool radius_{};  // DIAMOF
  Interpreted all_;
  std::map<int, double> variables_;
  std::map<std::string, std::string> subroutines_;
  std::string in_, line_, message_, unchecked_;
  Reached now_;
  double motion_{1}, tool_{};
  bool linuxcnc_{}, millimetres_{}, plane_{}, work_offset_{}, feed_per_minute_{}, spindle_stands_{}, offset_{},
      coolant_off_{}, at_contact_{}, leaves_contact_{}, tip_control_{}, retracted_{}, height_known_{}, compared_{},
      frame_known_{};
};

}  // namespace

Interpreted interpret(const std::string& program, Machine machine) {
  Control control{machine};
  std::istringstream lines{program};
  for (std::string line; std::getline(lines, line);) control.take(line);
  return control.done();
}

}  // namespace probebox
