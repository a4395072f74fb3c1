#include "firmware/tape/report.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::tape {
namespace {

constexpr double kMost_deg = 3600;
constexpr double kMost_mm = 1e5;
constexpr double kMostLength_mm = 2000;
constexpr double kMostStep = 65535;
constexpr double kMostSpeed_mm_s = 6553.5;

struct Word {
  char letter{};
  double value{};
};

// Grammar of a kind of line: its word, and the letters after it with their limits.
enum class Kind { begin, end, abandon, home, pose, cut, status, corrections, centreline, delay, all };
struct Keyword {
  std::string_view text;
  Kind kind;
  std::string_view letters;  // '#': the number that follows the word
};
// Longer words before those that they begin with.
constexpr std::array<Keyword, 11> kKeywords{{{"BEGIN", Kind::begin, "#ABCTF"},
                                             {"END", Kind::end, "#ABCTF"},
                                             {"ABANDON", Kind::abandon, "#ABCTF"},
                                             {"HOME", Kind::home, "XYZ"},
                                             {"POSE", Kind::pose, "ABCTL"},
                                             {"CUT", Kind::cut, "#"},
                                             {"STATUS", Kind::status, ""},
                                             {"CORRECTIONS", Kind::corrections, ""},
                                             {"CENTRELINE", Kind::centreline, ""},
                                             {"DELAY", Kind::delay, ""},
                                             {"ALL", Kind::all, ""}}};

struct Limits {
  char letter;
  double least, most;
  bool whole;
  const char* what;
};
constexpr std::array<Limits, 11> kLimits{{{'#', 0, kMostStep, true, "a step from 0 to 65535"},
                                          {'A', -kMost_deg, kMost_deg, false, "-3600 to 3600 degrees"},
                                          {'B', -kMost_deg, kMost_deg, false, "-3600 to 3600 degrees"},
                                          {'C', -kMost_deg, kMost_deg, false, "-3600 to 3600 degrees"},
                                          {'T', 0, 65535, true, "a tool from 0 to 65535"},
                                          {'F', 0, kMostSpeed_mm_s, false, "0 to 6553.5 mm/s"},
                                          {'L', 0, kMostLength_mm, false, "0 to 2000 mm"},
                                          {'X', -kMost_mm, kMost_mm, false, "-100000 to 100000 mm"},
                                          {'Y', -kMost_mm, kMost_mm, false, "-100000 to 100000 mm"},
                                          {'Z', -kMost_mm, kMost_mm, false, "-100000 to 100000 mm"},
                                          {'\0', 0, 0, false, ""}}};

Refused refused(const char* name, const std::string& what) {
  return {name, what};
}

std::string squeezed(std::string_view line) {
  std::string text;
  for (const char c : line) {
    if (c != ' ' && c != '*' && c != '\t') text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return text;
}

std::string quoted(char letter) {
  return letter == '#' ? "the number" : std::string{"'"} + letter + "'";
}

std::optional<Refused> whyNot(const Word& word, std::string_view letters, const std::vector<Word>& before) {
  if (letters.find(word.letter) == std::string_view::npos)
    return refused("unknown-word", quoted(word.letter) + " has no meaning in this line: omit it");
  if (std::ranges::find(before, word.letter, &Word::letter) != before.end())
    return refused("repeated-word", quoted(word.letter) + " is given twice: give it once");
  const auto& limits = *std::ranges::find(kLimits, word.letter, &Limits::letter);
  const bool good = word.value >= limits.least && word.value <= limits.most &&
                    (!limits.whole || word.value == std::floor(word.value));
  if (good) return std::nullopt;
  return refused("out-of-range", quoted(word.letter) + " has to be " + limits.what);
}

// A number as controls print it: "-12.3450", "+.5", "90.".
std::optional<double> numberAt(std::string_view text, std::size_t& at) {
  const std::size_t from = at;
  if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
  while (at < text.size() && (std::isdigit(static_cast<unsigned char>(text[at])) != 0 || text[at] == '.')) ++at;
  const std::size_t begin = from < at && text[from] == '+' ? from + 1 : from;
  const std::string_view digits = text.substr(begin, at - begin);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  const auto rest = digits.substr(static_cast<std::size_t>(end - digits.data()));
  return rest.empty() ? std::optional{value} : std::nullopt;
}

Outcome<std::vector<Word>, Refused> wordsOf(std::string_view text, std::string_view letters) {
  std::vector<Word> words;
  for (std::size_t at = 0; at < text.size();) {
    Word word{.letter = '#'};
    const char c = text[at];
    if (c >= 'A' && c <= 'Z') {
      word.letter = c;
      ++at;
    } else if (!words.empty() || letters.empty()) {
      return refused("bad-character", std::string{"'"} + c + "' begins no word: a word is a letter and a number");
    }
    const auto value = numberAt(text, at);
    if (!value) return refused("bad-number", "no number follows " + quoted(word.letter) + ": write it as X-12.345");
    word.value = *value;
    if (auto why = whyNot(word, letters, words)) return *why;
    words.push_back(word);
  }
  return words;
}

std::optional<double> valueOf(const std::vector<Word>& words, char letter) {
  const auto found = std::ranges::find(words, letter, &Word::letter);
  return found == words.end() ? std::nullopt : std::optional{found->value};
}

double radiansOf(const std::vector<Word>& words, std::size_t axis) {
  return radians(valueOf(words, "ABC"[axis]).value_or(0));
}

Outcome<Report, Refused> markerOf(const std::vector<Word>& words, MarkerPhase phase) {
  const auto step = valueOf(words, '#');
  if (!step) return refused("missing-number", "a marker names its step: write BEGIN0, END0 or ABANDON0");
  Marker marker{.step = static_cast<std::uint32_t>(*step), .phase = phase};
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) marker.rotary_angles_rad[axis] = radiansOf(words, axis);
  marker.tool = static_cast<std::uint32_t>(valueOf(words, 'T').value_or(0));
  marker.nominal_speed_mm_s = valueOf(words, 'F').value_or(0);
  marker.at_rest = true;  // a control prints between motions
  return Report{Said{marker}};
}

Outcome<Report, Refused> homingOf(const std::vector<Word>& words) {
  if (words.empty()) return refused("missing-word", "a homing names its axes: write HOME X0. Z120.5");
  Said said;
  for (const auto& word : words) said.emplace_back(AxisHomed{static_cast<Axis>(word.letter - 'X'), word.value, {}});
  return Report{said};
}

Outcome<Report, Refused> poseOf(const std::vector<Word>& words) {
  if (words.empty()) return refused("missing-word", "a pose has an angle or a tool: write POSE B30. T4");
  if (valueOf(words, 'L') && !valueOf(words, 'T'))
    return refused("missing-word", "a length belongs to a tool: write POSE T4 L120.");
  PoseTold pose;
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    if (valueOf(words, "ABC"[axis])) pose.axes = static_cast<std::uint8_t>(pose.axes | 1U << axis);
    pose.angles_rad[axis] = radiansOf(words, axis);
  }
  pose.has_tool = valueOf(words, 'T').has_value();
  pose.tool = static_cast<std::uint32_t>(valueOf(words, 'T').value_or(0));
  pose.tool_length_mm = valueOf(words, 'L').value_or(0);
  return Report{Said{pose}};
}

Outcome<Report, Refused> cutOf(const std::vector<Word>& words) {
  const auto on = valueOf(words, '#');
  if (!on || *on > 1) return refused("out-of-range", "a cut begins with CUT1 and is over with CUT0");
  return Report{Said{CutInhibit{.active = *on == 1, .at = {}}}};
}

Outcome<Report, Refused> positionsOf(std::string_view text) {
  TRY(const auto words, wordsOf(text, "XYZ"));
  Positions positions;
  for (const auto& word : words) positions.at_mm[static_cast<std::size_t>(word.letter - 'X')] = word.value;
  return Report{positions};
}

}  // namespace

Outcome<Report, Refused> understood(std::string_view line) {
  const std::string text = squeezed(line);
  for (const char c : text) {
    if (c < '!' || c > '~')
      return refused("bad-character", "a character that is no printable ASCII: check parity and speed");
  }
  const auto keyword = std::ranges::find_if(kKeywords, [&](const auto& one) { return text.starts_with(one.text); });
  if (keyword == kKeywords.end()) {
    const bool position = !text.empty() && text[0] >= 'X' && text[0] <= 'Z';
    if (position) return positionsOf(text);
    return refused("unknown-line",
                   "the line begins with none of BEGIN, END, ABANDON, HOME, POSE, CUT, X, Y, Z, STATUS, "
                   "CORRECTIONS, CENTRELINE, DELAY, ALL");
  }
  TRY(const auto words, wordsOf(std::string_view{text}.substr(keyword->text.size()), keyword->letters));
  switch (keyword->kind) {
    case Kind::begin:
      return markerOf(words, MarkerPhase::begin);
    case Kind::end:
      return markerOf(words, MarkerPhase::end);
    case Kind::abandon:
      return markerOf(words, MarkerPhase::abandon);
    case Kind::home:
      return homingOf(words);
    case Kind::pose:
      return poseOf(words);
    case Kind::cut:
      return cutOf(words);
    case Kind::status:
      return Report{Ask::status};
    case Kind::corrections:
      return Report{Ask::corrections};
    case Kind::centreline:
      return Report{Ask::centreline};
    case Kind::delay:
      return Report{Ask::delay};
    case Kind::all:
      return Report{Ask::all};
  }
  return Report{Ask::status};
}

}  // namespace probebox::tape
