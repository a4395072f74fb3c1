#include "interpreter.hpp"

#include <cstdlib>
#include <map>
#include <regex>
#include <sstream>

namespace probebox {
namespace {

class Control {
 public:
  void take(const std::string& raw) {
    if (printed(raw) || raw.empty() || raw == "%" || raw == ";" || raw[0] == ';' || raw[0] == '%') return;
    static const std::regex kPassed{
        R"(POPEN|PCLOS|STOPRE|TRAORI|TRAFOOF|MSG\("[^"]*"\)|MSG\(\)|DEF INT PB_ERR|EXTOPEN\(PB_ERR,"[^"]*","SYN","EXCL","APP"\)|EXTCLOSE\(PB_ERR,"[^"]*"\)|IF PB_ERR<>0|SETAL\(65000\)|ENDIF|\(.*\))"};
    if (std::regex_match(raw, kPassed)) return;
    static const std::regex kAssignment{R"(#(\d+)=(-?[\d.]+))"};
    std::smatch parts;
    if (std::regex_match(raw, parts, kAssignment)) {
      variables_[std::stoi(parts[1])] = std::stod(parts[2]);
      return;
    }
    block(std::regex_replace(raw, std::regex{R"(\([^()]*\))"}, ""), raw);
  }
  Interpreted done() { return std::move(all_); }

 private:
  Part& part() { return all_.parts.back(); }

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

  void block(const std::string& text, const std::string& raw) {
    static const std::regex kWord{R"(([A-Z])(-?\d+\.?\d*))"};
    std::map<char, double> words;
    std::vector<double> g, m;
    for (std::sregex_iterator word{text.begin(), text.end(), kWord}, end; word != end; ++word) {
      const char letter = (*word)[1].str()[0];
      const double value = std::stod((*word)[2]);
      if (letter == 'G')
        g.push_back(value);
      else if (letter == 'M')
        m.push_back(value);
      else
        words[letter] = value;
    }
    const std::string rest = std::regex_replace(text, kWord, "");
    if (rest.find_first_not_of(' ') != std::string::npos) all_.unknown.push_back(raw);
    for (const double code : m) machine(code);
    for (const double code : g) {
      if (code == 0 || code == 1) return move(words, code == 0);
      if (code == 2 || code == 3) return arc(words, static_cast<int>(code));
      if (code == 4) part().dwells.push_back(part().moves.size());
    }
  }

  // In the plane of X and Y, its centre from where it begins, as all these controls take it.
  void arc(const std::map<char, double>& words, int code) {
    const std::array centre_mm{now_.at_mm[0] + words.at('I'), now_.at_mm[1] + words.at('J')};
    move(words, false);
    part().moves.back().arc = code;
    part().moves.back().centre_mm = centre_mm;
  }

  void machine(double code) {
    if (code == 0) all_.parts.emplace_back();
    if (code == 2 || code == 30) all_.ended = true;
  }

  void move(const std::map<char, double>& words, bool rapid) {
    now_.rapid = rapid;
    bool linear = false;
    for (const auto& [letter, value] : words) {
      if (letter >= 'X' && letter <= 'Z') now_.at_mm[static_cast<std::size_t>(letter - 'X')] = value, linear = true;
      if (letter >= 'A' && letter <= 'C') now_.angles_deg[static_cast<std::size_t>(letter - 'A')] = value;
      if (letter == 'X') placed_ = true;
      if (letter == 'F') now_.feed_mm_min = value;
    }
    now_.z_only = !placed_;
    if (rapid && !linear) return;  // rotary axes alone
    part().moves.push_back(now_);
  }

  Interpreted all_;
  std::map<int, double> variables_;
  Reached now_;
  bool placed_{};
};

}  // namespace

Interpreted interpret(const std::string& program) {
  Control control;
  std::istringstream lines{program};
  for (std::string line; std::getline(lines, line);) control.take(line);
  return control.done();
}

}  // namespace probebox
