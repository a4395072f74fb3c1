#include "tools/interference/program.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "protocol/units/angle.hpp"

namespace probebox::interference {
namespace {

constexpr double kMmPerInch = 25.4;
constexpr double kFurthest = 1e5;  // of a word that is a place, mm or inch

struct Words {
  std::map<char, double> values;
  std::vector<int> g;  // times 10: G38.2 is 382
  std::vector<double> m;
};

Error objection(std::size_t line, const std::string& what) {
  return Error{"line " + std::to_string(line) + ": " + what};
}

// Without comments and blanks, in capitals. Where a comment within another ends, controls do not agree.
Outcome<std::string> bare(std::string_view text, std::size_t line) {
  std::string all;
  bool comment = false;
  for (const char c : text) {
    if (c == ';' && !comment) break;
    if (c == '(' && comment) return objection(line, "a comment within a comment: close the first one before it");
    if (c == ')' && !comment) return objection(line, "a ) that ends no comment: remove it");
    if (c == '(' || c == ')') {
      comment = c == '(';
    } else if (!comment && std::isspace(static_cast<unsigned char>(c)) == 0) {
      all += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  if (comment) return objection(line, "a comment without end: close it");
  return all;
}

Outcome<Words> wordsOf(const std::string& text, std::size_t line) {
  Words words;
  for (std::size_t at = 0; at < text.size();) {
    const char letter = text[at++];
    if (letter == '%' || letter == '/') {
      if (letter == '/') return objection(line, "a block that may be skipped: remove the slash, or the line");
      break;
    }
    if (at < text.size() && text[at] == '+') ++at;
    double value = 0;
    const auto [end, fault] =
        std::from_chars(text.data() + at, text.data() + text.size(), value, std::chars_format::fixed);
    // from_chars takes INF and NAN for numbers. Behind a number, E would be an exponent.
    const bool word = std::isalpha(static_cast<unsigned char>(letter)) != 0 && letter != 'E';
    if (!word || fault != std::errc{} || !std::isfinite(value))
      return objection(line,
                       "'" + text.substr(at - 1, 12) + "' is no word with a number: write out variables and calls");
    if (std::string_view{"GTXYZABCIJ"}.find(letter) != std::string_view::npos && std::abs(value) > kFurthest)
      return objection(line, "'" + text.substr(at - 1, 12) + "' is further than any machine reaches: correct it");
    at = static_cast<std::size_t>(end - text.data());
    if (letter == 'G') {
      words.g.push_back(static_cast<int>(std::lround(value * 10)));
    } else if (letter == 'M') {
      words.m.push_back(value);
    } else if (!words.values.emplace(letter, value).second) {
      return objection(line, std::string{"a second word "} + letter + ": remove one");
    }
  }
  return words;
}

class Reader {
 public:
  explicit Reader(const Dialect& dialect) : dialect_{dialect} {}

  std::optional<Error> read(const std::string& text, std::size_t line) {
    TRY(const auto words, wordsOf(text, line));
    for (const int g : words.g) {
      if (auto error = take(g, line)) return error;
    }
    const auto chosen = words.values.find('T');
    if (chosen != words.values.end()) chosen_tool_ = chosen->second;
    for (const double m : words.m) {
      if (auto error = machine(m, line)) return error;
    }
    return move(words, line);
  }
  std::vector<Move> moves() { return std::move(moves_); }

 private:
  std::optional<Error> take(int g, std::size_t line) {
    switch (g) {
      case 0:
      case 10:
      case 20:
      case 30:
        motion_ = g / 10;
        return std::nullopt;
      case 200:
        unit_mm_ = kMmPerInch;
        return std::nullopt;
      case 210:
        unit_mm_ = 1;
        return std::nullopt;
      case 900:
      case 910:
        relative_ = g == 910;
        return std::nullopt;
      default:
        break;
    }
    // Without effect on the path of the tip: plane XY, no compensation, feed modes, offsets that the cell states,
    // dwell.
    constexpr std::array kHarmless{40, 170, 400, 430, 490, 540, 610, 611, 640, 800, 911, 940, 950, 970};
    if (std::ranges::find(kHarmless, g) != kHarmless.end()) return std::nullopt;
    return objection(line, "G" + std::to_string(g / 10) + (g % 10 != 0 ? "." + std::to_string(g % 10) : "") +
                               " is not understood: write the path with G0 to G3 in the plane XY");
  }

  std::optional<Error> machine(double m, std::size_t line) const {
    constexpr std::array kCalls{96.0, 97.0, 98.0, 99.0, 198.0};
    const auto number = std::to_string(std::lround(m));
    if (std::ranges::find(kCalls, m) != kCalls.end())
      return objection(line, "M" + number + " goes on in another program: write its blocks out here");
    if (m == 6 && chosen_tool_ && *chosen_tool_ != dialect_.tool)
      return objection(line, "tool " + std::to_string(std::lround(*chosen_tool_)) + " is taken, and tool " +
                                 std::to_string(dialect_.tool) +
                                 " is checked: check the blocks of each tool by themselves");
    return std::nullopt;
  }

  std::optional<Error> move(const Words& words, std::size_t line) {
    for (const char second : {'U', 'V', 'W'}) {
      if (words.values.contains(second))
        return objection(line, std::string{"a word "} + second + ": write the path with X, Y and Z");
    }
    Angles to_deg = at_deg_;
    TRY(const bool turns, turned(words, line, to_deg));
    Point to = at_;
    bool moves = turns;
    for (std::size_t k = 0; k < to.size(); ++k) {
      const auto word = words.values.find("XYZ"[k]);
      if (word == words.values.end()) continue;
      if (relative_ && !known_[k]) return objection(line, "G91 before the place of the axis is known: begin with G90");
      to[k] = (relative_ ? at_[k] : 0) + word->second * unit_mm_;
      moves = true;
    }
    const bool from_known = known_[0] && known_[1] && known_[2];
    const bool arc = motion_ >= 2;
    if (!moves && !(arc && (words.values.contains('I') || words.values.contains('J')))) return std::nullopt;
    if (motion_ < 0) return objection(line, "a word for an axis before G0 to G3 has said how to move");
    if (!from_known) {
      if (arc) return objection(line, "an arc from a place that is not known: command X, Y and Z before");
      for (std::size_t k = 0; k < known_.size(); ++k) known_[k] = known_[k] || words.values.contains("XYZ"[k]);
      at_ = to;
      at_deg_ = to_deg;
      return std::nullopt;
    }
    if (arc && turns) return objection(line, "an arc while a rotary axis turns: write it with G1");
    if (arc) return arcTo(to, words, line);
    straightTo(to, to_deg, line);
    return std::nullopt;
  }

  // Whether a rotary axis is commanded, and the angles then.
  Outcome<bool> turned(const Words& words, std::size_t line, Angles& to_deg) const {
    bool any = false;
    for (std::size_t k = 0; k < to_deg.size(); ++k) {
      const auto word = words.values.find("ABC"[k]);
      if (word == words.values.end()) continue;
      if (!dialect_.rotary[k])
        return objection(line, std::string{"a word "} + "ABC"[k] + ": the cell has no [[rotary_axis]] of that letter");
      to_deg[k] = (relative_ ? at_deg_[k] : 0) + word->second;
      any = true;
    }
    return any;
  }

  void straightTo(const Point& to, const Angles& to_deg, std::size_t line) {
    moves_.push_back({line, motion_ == 0, at_, to, at_deg_, to_deg});
    at_ = to;
    at_deg_ = to_deg;
  }

  // With its middle; Z changes evenly on the way.
  std::optional<Error> arcTo(const Point& to, const Words& words, std::size_t line) {
    if (words.values.contains('R') || words.values.contains('K'))
      return objection(line, "an arc by R or K: write it with I and J, the middle from its beginning");
    if (words.values.contains('P')) return objection(line, "an arc of several turns (P): write each turn by itself");
    const auto given = [&](char letter) {
      const auto word = words.values.find(letter);
      return word == words.values.end() ? 0 : word->second * unit_mm_;
    };
    const double i = given('I'), j = given('J');
    const double cx = at_[0] + i, cy = at_[1] + j, radius = std::hypot(i, j);
    const double off = std::abs(std::hypot(to[0] - cx, to[1] - cy) - radius);
    if (!(radius > 0) || off > std::max(0.01, 1e-3 * radius))
      return objection(line, "the end of the arc is not on its circle: correct I and J");
    const double from = std::atan2(-j, -i);
    double turn = std::atan2(to[1] - cy, to[0] - cx) - from;
    if (motion_ == 2 && turn >= -1e-9) turn -= kTurn;
    if (motion_ == 3 && turn <= 1e-9) turn += kTurn;
    const double each = 2 * std::acos(std::max(0.0, 1 - dialect_.tolerance_mm / radius));
    const auto count = std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(std::abs(turn) / each)), 1, 100'000);
    const double z = at_[2];
    for (std::size_t k = 1; k < count; ++k) {
      const double part = static_cast<double>(k) / static_cast<double>(count);
      straightTo({cx + radius * std::cos(from + part * turn), cy + radius * std::sin(from + part * turn),
                  z + part * (to[2] - z)},
                 at_deg_, line);
    }
    straightTo(to, at_deg_, line);
    return std::nullopt;
  }

  Point at_{};
  Angles at_deg_{};
  std::array<bool, 3> known_{};
  Dialect dialect_;
  std::optional<double> chosen_tool_;  // by the last T
  double unit_mm_{1};
  bool relative_{};
  int motion_{-1};
  std::vector<Move> moves_;
};

}  // namespace

Outcome<std::vector<Move>> readProgram(std::string_view text, const Dialect& dialect) {
  Reader reader{dialect};
  for (std::size_t line = 1; !text.empty(); ++line) {
    const auto end = text.find('\n');
    TRY(const auto block, bare(text.substr(0, end), line));
    if (const auto error = reader.read(block, line)) return *error;
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return reader.moves();
}

}  // namespace probebox::interference
