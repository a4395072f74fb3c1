#include "tools/probebox/screen/watch_page.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "protocol/units/angle.hpp"
#include "protocol/units/wording.hpp"
#include "tools/probebox/screen/machine_page.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kLabel = 12;       // columns of the labels at the left
constexpr std::size_t kValueWidth = 24;  // "   a   -123456 nm  "
constexpr std::size_t kFirstDeflection = 11;
constexpr std::size_t kRowsBelow = 8;

class Page {
 public:
  Page(ScreenSize size, bool utf8) : size_{size}, utf8_{utf8} {}

  void put(std::size_t row, std::size_t column, std::string text, Style style = Style::plain) {
    if (row < size_.rows && column < size_.columns) spans_.push_back({row, column, std::move(text), style});
  }
  void label(std::size_t row, const std::string& text) { put(row, 1, text, Style::soft); }
  void bar(std::size_t row, std::string text) {
    text.resize(size_.columns, ' ');
    put(row, 0, std::move(text), Style::bar);
  }

  // As many whole words as there is room for.
  void words(std::size_t row, std::size_t column, const std::string& text, Style style = Style::plain) {
    put(row, column, shortened(text, size_.columns - column), style);
  }

  ScreenSize size() const { return size_; }
  bool utf8() const { return utf8_; }
  std::vector<Span> take() { return std::move(spans_); }

 private:
  ScreenSize size_;
  bool utf8_;
  std::vector<Span> spans_;
};

Style styleOf(ClockState state) {
  if (state == ClockState::locked) return Style::good;
  return state == ClockState::holdover ? Style::warned : Style::bad;
}

std::string upTime(std::uint64_t ms) {
  const auto s = ms / 1000;
  return printed("up %3llu:%02llu:%02llu", static_cast<unsigned long long>(s / 3600),
                 static_cast<unsigned long long>(s / 60 % 60), static_cast<unsigned long long>(s % 60));
}

// At the right of the title: whether what stands below is of this moment.
void mark(Page& page, const WatchState& state) {
  const std::string mark = !state.link_up ? " LINK LOST " : state.held ? " HELD " : " LIVE ";
  const auto style = !state.link_up ? Style::bad : state.held ? Style::warned : Style::good;
  page.put(0, page.size().columns - mark.size() - 1, mark, style);
}

void title(Page& page, const WatchState& state) {
  const auto& d = state.descriptor;
  page.bar(0, shownLines(" probebox  " + d.board + " " + d.serial_number + "   " + d.machine + "   " + d.probe));
  mark(page, state);
}

void clockAndSamples(Page& page, const WatchState& state) {
  page.label(1, "Clock");
  page.label(2, "Samples");
  page.label(3, "Losses");
  if (!state.beat) return page.put(1, kLabel, "no heartbeat yet", Style::warned);
  const auto& beat = *state.beat;
  page.put(1, kLabel, std::string{messages::nameOf(beat.clock_state)}, styleOf(beat.clock_state));
  page.put(1, kLabel + 12, printed("sigma %9s", readableNs(beat.clock_sigma_ns).c_str()));
  page.put(1, kLabel + 31, upTime(beat.uptime_ms));
  page.put(1, kLabel + 46, printed("late ticks %llu", static_cast<unsigned long long>(beat.deadline_misses)),
           beat.deadline_misses > 0 ? Style::warned : Style::plain);
  const auto& sums = state.sums;
  const auto lost = sums.declaredLost() + sums.lost_on_link;
  page.put(2, kLabel,
           printed("%13llu = %13llu received + %9llu lost", static_cast<unsigned long long>(sums.produced),
                   static_cast<unsigned long long>(sums.received), static_cast<unsigned long long>(lost)),
           lost > 0 ? Style::warned : Style::plain);
  page.put(2, kLabel + 58, state.balanced ? "exact" : "NOT EXACT", state.balanced ? Style::good : Style::bad);
  if (state.restarts > 0)
    page.words(9, kLabel + 12,
               printed("box restarted %llu times: what was before is unknown",
                       static_cast<unsigned long long>(state.restarts)));
  page.put(
      3, kLabel,
      printed("source %8llu  queue %8llu  link %8llu  reconnected %llu",
              static_cast<unsigned long long>(sums.lost_at_source), static_cast<unsigned long long>(sums.lost_in_queue),
              static_cast<unsigned long long>(sums.lost_on_link),
              static_cast<unsigned long long>(state.reconnections)));
}

void mayCut(Page& page, const WatchState& state) {
  page.label(4, "May I cut?");
  const auto word = std::string{wordOf(state.verdict.may_cut)};
  page.put(4, kLabel, word, styleOf(state.verdict.may_cut));
  page.words(4, kLabel + word.size() + 2, shownLines(state.verdict.reason));
}

bool isDeflection(const WatchState::Channel& channel) {
  return channel.name.starts_with("deflection");
}

std::string axisOf(const std::string& name) {
  return shownLines(name.substr(name.rfind('_') + 1));
}

void positions(Page& page, const WatchState& state) {
  page.label(5, "Position");
  std::size_t column = kLabel;
  std::size_t number = 0;
  for (const auto& channel : state.channels) {
    if (!channel.name.starts_with("position")) continue;
    auto axis = axisOf(channel.name);
    for (auto& c : axis) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    page.put(5, column, axis, Style::soft);
    // Samples hold what the encoders count; where an axis is referenced, the box knows its machine position.
    const auto* known =
        state.corrections && number < state.corrections->axes.size() ? &state.corrections->axes[number] : nullptr;
    const bool referenced = known != nullptr && known->referenced;
    page.put(5, column + 2,
             printed("%+12.4f %s", referenced ? known->position_mm : channel.value, shownLines(channel.unit).c_str()),
             referenced ? Style::strong : Style::warned);
    column += 22;
    ++number;
  }
  page.label(6, "Angle");
  if (!state.corrections) return;
  column = kLabel;
  const auto& axes = state.corrections->rotary;
  for (std::size_t k = 0; k < axes.size() && k < 3; ++k) {
    if (!axes[k].described) continue;
    page.put(6, column, std::string(1, "ABC"[k]), Style::soft);
    page.put(6, column + 2, axes[k].known ? printed("%+12.4f deg", degrees(axes[k].angle_rad)) : "     not known",
             axes[k].known && !axes[k].doubtful ? Style::plain : Style::warned);
    column += 22;
  }
}

void corrections(Page& page, const WatchState& state) {
  constexpr std::array kHealths{"absent", "good", "held", "invalid"};
  constexpr std::array kStyles{Style::soft, Style::good, Style::warned, Style::bad};
  page.label(7, "Correction");
  page.label(8, "Sources");
  if (!state.corrections) return;
  const auto& c = *state.corrections;
  for (std::size_t k = 0; k < 3; ++k) {
    page.put(7, kLabel + 22 * k, std::string(1, "XYZ"[k]), Style::soft);
    page.put(7, kLabel + 22 * k + 2, printed("%+12.1f um", c.correction_mm[k] * 1e3));
  }
  const auto* words = !c.valid ? "invalid" : c.degraded ? "degraded" : "";
  page.put(9, kLabel, words, c.valid ? Style::warned : Style::bad);
  constexpr std::array<std::size_t, 4> kColumns{0, 15, 31, 47};
  for (std::size_t bit = 0; bit < kSourceKinds; ++bit) {
    const auto health = static_cast<std::size_t>(c.health[bit]);
    if (health >= kHealths.size()) continue;
    const auto column = kLabel + kColumns[bit];
    const auto name = kSources[bit].name;
    const bool matters = (unsigned{c.mask} >> bit & 1U) != 0 || c.health[bit] == published::Health::good;
    page.put(8, column, std::string{name}, Style::soft);
    page.put(8, column + name.size() + 1, kHealths[health], matters ? kStyles[health] : Style::soft);
  }
}

// 1, 2 or 5 times a power of ten, so that the scale seldom changes.
double fullScale(double peak, double least) {
  double scale = least;
  for (int k = 0; scale < peak && k < 60; ++k) scale *= k % 3 == 1 ? 2.5 : 2;
  return scale;
}

// A bar from the middle to the value.
std::string bar(double fraction, std::size_t width, bool utf8) {
  const auto half = width / 2;
  const auto length =
      static_cast<std::size_t>(std::lround(std::min(1.0, std::abs(fraction)) * static_cast<double>(half)));
  std::string all;
  for (std::size_t k = 0; k < 2 * half + 1; ++k) {
    const bool left = k < half;
    const auto distance = left ? half - k : k - half;
    const bool filled = k != half && distance <= length && left == (fraction < 0);
    all += k == half ? (utf8 ? "│" : "|") : filled ? (utf8 ? "█" : "#") : (utf8 ? "·" : ".");
  }
  return all;
}

// One row of a picture of peaks: how much of the cell is filled, in eighths.
std::string cell(double filled, bool utf8) {
  constexpr std::array kBlocks{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::array kLetters{" ", ".", ".", ":", ":", "|", "|", "#", "#"};
  const auto level = static_cast<std::size_t>(std::lround(std::clamp(filled, 0.0, 1.0) * 8));
  return utf8 ? kBlocks[level] : kLetters[level];
}

void history(Page& page, const WatchState::Channel& channel, std::size_t row, std::size_t rows, double scale) {
  const auto extents = channel.history.columns(page.size().columns - kValueWidth - 2);
  for (std::size_t r = 0; r < rows; ++r) {
    std::string line;
    for (const auto& extent : extents) {
      const double height = extent.any ? std::max(-extent.low, extent.high) / scale * static_cast<double>(rows) : 0;
      line += cell(height - static_cast<double>(rows - 1 - r), page.utf8());
    }
    page.put(row + r, kValueWidth, line, Style::soft);
  }
}

void deflections(Page& page, const WatchState& state) {
  std::size_t count = 0;
  double peak = 0;
  for (const auto& channel : state.channels) {
    if (!isDeflection(channel)) continue;
    ++count;
    peak = std::max(peak, channel.history.peak());
  }
  if (count == 0) return;
  const double scale = fullScale(peak, 1000);
  const auto room = page.size().rows - kFirstDeflection - kRowsBelow;
  const auto each = std::clamp<std::size_t>(room / count, 2, 8);
  page.label(kFirstDeflection - 1, "Deflection");
  page.put(kFirstDeflection - 1, page.size().columns - 42,
           printed("%40s", printed("bars to +-%g um; peaks of the last 10 s", scale * 1e-3).c_str()), Style::soft);
  std::size_t row = kFirstDeflection;
  for (const auto& channel : state.channels) {
    if (!isDeflection(channel) || row + each > page.size().rows - kRowsBelow + 1) continue;
    page.put(row, 3, axisOf(channel.name), Style::soft);
    page.put(row, 5, printed("%+11.0f %s", channel.value, shownLines(channel.unit).c_str()), Style::strong);
    page.put(row, kValueWidth, bar(channel.value / scale, page.size().columns - kValueWidth - 3, page.utf8()),
             std::abs(channel.value) > scale ? Style::bad : Style::good);
    history(page, channel, row + 1, each - 1, scale);
    row += each;
  }
}

std::string inWords(const messages::ProcedureStatus::Answer& p) {
  std::string all{messages::nameOf(p.state)};
  if (!p.method.empty()) all = p.method + "  " + all;
  if (p.state == RunState::waiting || p.state == RunState::running)
    all += printed("  step %u of %u", p.step + 1, p.steps);
  return p.refusal.empty() ? all : all + "  " + p.refusal;
}

// What to do next has two rows.
void procedure(Page& page, const WatchState& state, std::size_t row) {
  page.label(row, "Procedure");
  if (!state.procedure) return;
  const auto& p = *state.procedure;
  page.words(row, kLabel, shownLines(inWords(p)));
  const bool waits = p.state == RunState::waiting || p.state == RunState::running;
  if (!waits) return;
  for (const auto& line : wrapped(shownLines(p.prompt), page.size().columns - 1 - kLabel, 2))
    page.put(++row, kLabel, line, Style::strong);
}

void cut(Page& page, const WatchState& state, std::size_t row) {
  page.label(row, "Cut");
  if (const auto who = whoCuts(state.status, state.corrections); !who.empty()) {
    page.put(row, kLabel, "ON", Style::bad);
    return page.words(row, kLabel + 4, shownLines(who));
  }
  page.put(row, kLabel, state.corrections ? "none" : "not known", Style::plain);
}

void trigger(Page& page, const WatchState& state, std::size_t row) {
  page.label(row, "Trigger");
  if (!state.trigger) return page.put(row, kLabel, "none yet", Style::soft);
  const auto& t = *state.trigger;
  page.put(row, kLabel, printed("%6u line %u", t.number, unsigned{t.line}));
  page.put(row, kLabel + 14, printed("%7.1f s ago", std::max(0.0, toSeconds(state.newest - t.at))));
  std::string at;
  for (std::size_t k = 0; k < 3; ++k) {
    if ((unsigned{t.has_position} >> k & 1U) != 0) at += printed(" %c %+10.4f", "XYZ"[k], t.position_mm[k]);
  }
  page.put(row, kLabel + 27, at);
}

void events(Page& page, const WatchState& state, bool both) {
  auto row = page.size().rows - 7;
  cut(page, state, row);
  trigger(page, state, ++row);
  page.label(++row, "Result");
  if (state.result) page.words(row, kLabel, shownLines(line(*state.result)));
  if (!state.result) page.put(row, kLabel, "none", Style::soft);
  if (!state.note.empty()) page.words(row + 3, 1, shownLines(state.note), Style::warned);
  procedure(page, state, row + 1);
  page.bar(page.size().rows - 1,
           both ? " q quit   space hold   r forget peaks" : " q quit   space hold   m machine   r forget peaks");
}

std::vector<Span> livePage(const WatchState& state, ScreenSize size, bool utf8, bool both) {
  Page page{size, utf8};
  title(page, state);
  clockAndSamples(page, state);
  mayCut(page, state);
  positions(page, state);
  corrections(page, state);
  deflections(page, state);
  events(page, state, both);
  return page.take();
}

}  // namespace

std::vector<Span> watchPage(const WatchState& state, ScreenSize size, bool utf8) {
  // A terminal may shrink at any time, and everything below counts on its room.
  if (!size.fits()) return {{0, 0, "This screen is too small: 80 columns and 24 rows are needed."}};
  if (size.columns < kColumnsForBoth) {
    if (!state.machine_page) return livePage(state, size, utf8, false);
    auto spans = machinePage(state.verdict, {size.rows - 1, size.columns}, utf8);
    Page page{size, utf8};
    mark(page, state);
    page.bar(size.rows - 1, " q quit   space hold   m live");
    for (auto& span : page.take()) spans.push_back(std::move(span));
    return spans;
  }
  const std::size_t live = size.columns * 11 / 20;
  auto spans = livePage(state, {size.rows, live}, utf8, true);
  for (auto& span : machinePage(state.verdict, {size.rows, size.columns - live}, utf8)) {
    span.column += live;
    spans.push_back(std::move(span));
  }
  return spans;
}

}  // namespace probebox::command
