#include "tools/probebox/screen/machine_page.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "protocol/units/wording.hpp"
#include "tools/probebox/text/due.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kMargin = 2, kReasonRows = 3, kRowsOfTile = 4;

// "[ok] YES": told apart without colours too.
std::string signOf(MayCut may_cut) {
  constexpr std::array<std::string_view, 4> kSigns{"[??]", "[ok]", "[!!]", "[XX]"};
  std::string word{wordOf(may_cut)};
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return std::string{kSigns[static_cast<std::size_t>(may_cut)]} + " " + word;
}

// "2026-11-28 12:05" of a date that is known.
std::string minuteOf(const std::string& utc) {
  if (utc.size() < 16 || utc[10] != 'T') return utc;
  return utc.substr(0, 10) + " " + utc.substr(11, 5);
}

// The trend as one row of blocks between its least and its largest value.
std::string sparkline(const Trend& trend, bool utf8) {
  constexpr std::array kBlocks{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  if (!utf8 || trend.points.size() < 2) return {};
  const auto [low, high] = std::ranges::minmax_element(trend.points, {}, &TrendPoint::value);
  const double range = high->value - low->value;
  std::string all;
  for (const auto& point : trend.points) {
    const double part = range > 0 ? (point.value - low->value) / range : 0.5;
    all += kBlocks[static_cast<std::size_t>(std::lround(part * 7))];
  }
  return all;
}

std::string wordOn(const SubjectTile& tile) {
  if (tile.id == 0) return "not measured";
  if (tile.due && tile.due->state == published::DueState::overdue) return dueText(tile);
  if (!tile.decisive) return {};
  if (tile.decisive->ratio) return printed("%.0f %% of its limit", 100 * *tile.decisive->ratio);
  return limitText(*tile.decisive);
}

// Writes texts that may be of the box: on a row none of them moves the cursor.
class Writer {
 public:
  Writer(ScreenSize size, std::vector<Span>& spans) : size_{size}, spans_{spans} {}
  bool hasRoom(std::size_t rows) const { return row_ + rows + 1 <= size_.rows; }
  std::size_t room() const { return size_.columns - 2 * kMargin; }
  void skip(std::size_t rows = 1) { row_ += rows; }
  void put(const std::string& text, Style style, std::size_t indent = 0) {
    spans_.push_back({row_++, kMargin + indent, shortened(shown(text), room() - indent), style});
  }
  // On the row of the last put().
  void right(const std::string& text, Style style) {
    if (text.size() < room()) spans_.push_back({row_ - 1, size_.columns - kMargin - text.size(), shown(text), style});
  }
  void paragraph(const std::string& text, std::size_t lines, Style style) {
    for (const auto& line : wrapped(shown(text), room(), lines)) put(line, style);
  }

 private:
  ScreenSize size_;
  std::vector<Span>& spans_;
  std::size_t row_{1};
};

void writeTile(const SubjectTile& tile, bool utf8, Writer& page) {
  page.put(tile.title, Style::strong);
  page.right(wordOn(tile), styleOf(tile.may_cut));
  if (tile.decisive) page.put(tile.decisive->text, Style::plain, 2);
  const auto spark = sparkline(tile.trend, utf8);
  std::string times;
  if (tile.age_days) times = "stored " + durationText(*tile.age_days) + " ago, " + dueText(tile);
  if (!tile.accepted_by.empty())
    times +=
        (times.empty() ? "" : "; ") + ("in force since " + minuteOf(tile.accepted_utc)) + " by " + tile.accepted_by;
  if (!spark.empty()) times = spark + "  " + times;
  if (!times.empty()) page.put(times, Style::soft, 2);
  const auto& first = tile.idle_limits.empty() ? tile.remarks : tile.idle_limits;
  if (!first.empty()) page.put(first.front(), Style::warned, 2);
}

}  // namespace

Style styleOf(MayCut may_cut) {
  constexpr std::array kStyles{Style::soft, Style::good, Style::warned, Style::bad};
  return kStyles[static_cast<std::size_t>(may_cut)];
}

std::vector<std::string> wrapped(std::string_view text, std::size_t columns, std::size_t lines) {
  std::vector<std::string> all;
  std::string line;
  const auto widthOf = [](std::string_view some) {  // of UTF-8, a column a character
    return static_cast<std::size_t>(
        std::ranges::count_if(some, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
  };
  while (!text.empty() && all.size() < lines) {
    const auto end = std::min(text.find(' '), text.size());
    const auto word = text.substr(0, end);
    const bool last = all.size() + 1 == lines, more = text.find_first_not_of(' ', end) != std::string_view::npos;
    const std::size_t kept = last && more ? 4 : 0;  // " ..."
    if (line.empty() || widthOf(line) + 1 + widthOf(word) + kept <= columns) {
      if (!word.empty()) line += (line.empty() ? "" : " ") + std::string{word};
      text.remove_prefix(std::min(end + 1, text.size()));
      continue;
    }
    all.push_back(last ? line + " ..." : line);
    line.clear();
  }
  if (!line.empty() && all.size() < lines) all.push_back(line);
  return all;
}

std::string shortened(std::string_view text, std::size_t columns) {
  const auto lines = wrapped(text, columns, 1);
  return lines.empty() ? std::string{} : lines.front();
}

std::vector<Span> machinePage(const MachineVerdict& verdict, ScreenSize size, bool utf8) {
  std::string title = " Machine";
  title.resize(size.columns, ' ');
  std::vector<Span> spans{{0, 0, std::move(title), Style::bar}};
  Writer page{size, spans};
  page.skip();
  page.put("May I cut?", Style::soft);
  page.put(signOf(verdict.may_cut), styleOf(verdict.may_cut));
  page.paragraph(verdict.reason, kReasonRows, Style::strong);
  if (!verdict.cut.empty()) page.put("A cut is on: " + verdict.cut, Style::warned);
  for (const auto& tile : verdict.tiles) {
    if (!page.hasRoom(kRowsOfTile + 1)) {
      page.put("more subjects than this terminal has rows for", Style::soft);
      break;
    }
    page.skip();
    writeTile(tile, utf8, page);
  }
  if (!verdict.more.empty() && page.hasRoom(2)) page.skip();
  for (const auto& sentence : verdict.more) {
    if (!page.hasRoom(2)) break;
    page.paragraph("also: " + sentence, 2, Style::warned);
  }
  return spans;
}

}  // namespace probebox::command
