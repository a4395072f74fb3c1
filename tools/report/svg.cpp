#include "tools/report/svg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "protocol/units/angle.hpp"
#include "tools/report/html.hpp"

namespace probebox::report {
namespace {

constexpr double kWidth = 460.0;
constexpr double kHeight = 300.0;
constexpr double kSquareHeight = 400.0;
constexpr double kLeft = 72.0;
constexpr double kRight = 14.0;
constexpr double kTitleLeft = 14.0;
constexpr double kTop = 28.0;
constexpr double kBottom = 48.0;
constexpr double kLegendLine = 18.0;
constexpr double kLegendIndent = 30.0;
constexpr double kCharacter = 6.6;      // mean width of one at the font size of a legend
constexpr double kBoldCharacter = 8.0;  // and of a title
constexpr std::size_t kMostDrawn = 1000;

struct Paint {
  const char* colour;
  const char* dash;
  double width;
};

Paint paintOf(Look look) {
  switch (look) {
    case Look::dots:
    case Look::specks:
    case Look::solid:
      return {"var(--series1,#1b4f8a)", "", 1.5};
    case Look::squares:
      return {"var(--series2,#b04a00)", "", 1.5};
    case Look::dashed:
      return {"var(--series2,#b04a00)", "6 3", 1.5};
    case Look::triangles:
      return {"var(--series3,#2a7a2a)", "", 1.5};
    case Look::dotted:
      return {"var(--series4,#666666)", "2 3", 1.0};
  }
  return {"#000000", "", 1.0};
}

bool isLine(Look look) {
  return look == Look::solid || look == Look::dashed || look == Look::dotted;
}

std::string pixels(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

// A tick with as many decimals as its step has.
std::string tickText(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  std::array<char, 48> text{};
  if (std::abs(value) >= 1e6 || step < 1e-6) {
    std::snprintf(text.data(), text.size(), "%.4g", value);
  } else {
    std::snprintf(text.data(), text.size(), "%.*f", decimals, std::abs(value) < step / 1e3 ? 0.0 : value);
  }
  return text.data();
}

bool finite(const Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y);
}

// Keeps the lowest and the highest point of every stretch, in their order.
std::vector<Point> thinned(const std::vector<Point>& points) {
  if (points.size() <= kMostDrawn) return points;
  const std::size_t stretch = 2 * points.size() / kMostDrawn + 1;
  std::vector<Point> kept;
  for (std::size_t from = 0; from < points.size(); from += stretch) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = points.begin() + static_cast<std::ptrdiff_t>(std::min(from + stretch, points.size()));
    auto [low, high] = std::minmax_element(begin, end, [](const Point& a, const Point& b) { return a.y < b.y; });
    if (high < low) std::swap(low, high);
    kept.push_back(*low);
    if (low != high) kept.push_back(*high);
  }
  return kept;
}

std::string marker(Look look, double x, double y) {
  const Paint paint = paintOf(look);
  if (look == Look::squares) {
    return "<rect x=\"" + pixels(x - 3) + "\" y=\"" + pixels(y - 3) + "\" width=\"6\" height=\"6\" fill=\"" +
           paint.colour + "\"/>";
  }
  if (look == Look::triangles) {
    return "<path d=\"M" + pixels(x - 4) + " " + pixels(y + 3) + "h8l-4 -7z\" fill=\"" + paint.colour + "\"/>";
  }
  return "<circle cx=\"" + pixels(x) + "\" cy=\"" + pixels(y) + "\" r=\"" + (look == Look::specks ? "1.3" : "3") +
         "\" fill=\"" + paint.colour + "\"/>";
}

std::string stroke(const Paint& paint) {
  std::string text = std::string{"stroke=\""} + paint.colour + "\" stroke-width=\"" + pixels(paint.width) + "\"";
  if (*paint.dash != '\0') text += std::string{" stroke-dasharray=\""} + paint.dash + "\"";
  return text;
}

std::string segment(double x1, double y1, double x2, double y2, const Paint& paint) {
  return "<line x1=\"" + pixels(x1) + "\" y1=\"" + pixels(y1) + "\" x2=\"" + pixels(x2) + "\" y2=\"" + pixels(y2) +
         "\" " + stroke(paint) + "/>";
}

std::string words(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return "<text x=\"" + pixels(x) + "\" y=\"" + pixels(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" +
         escaped(text) + "</text>";
}

// Breaks words into lines of at most this many characters; a longer word has a line of its own.
std::vector<std::string> wrapped(const std::string& text, std::size_t most) {
  std::vector<std::string> lines{{}};
  for (std::size_t from = 0; from < text.size();) {
    const auto until = std::min(text.find(' ', from), text.size());
    const std::string word = text.substr(from, until - from);
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > most) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    from = until + 1;
  }
  return lines;
}

std::vector<std::string> legendLines(const std::string& legend) {
  return wrapped(legend, static_cast<std::size_t>((kWidth - kRight - kLeft - kLegendIndent) / kCharacter));
}

std::vector<std::string> titleLines(const std::string& title) {
  return wrapped(title, static_cast<std::size_t>((kWidth - kRight - kTitleLeft) / kBoldCharacter));
}

std::string arrow(double x1, double y1, double x2, double y2, const Paint& paint) {
  const double length = std::hypot(x2 - x1, y2 - y1);
  std::string drawn = segment(x1, y1, x2, y2, paint);
  if (length < 1.0) return drawn;
  const double ux = (x2 - x1) / length;
  const double uy = (y2 - y1) / length;
  const double head = std::min(6.0, 0.6 * length);
  for (const double side : {-0.5, 0.5}) {
    drawn += segment(x2, y2, x2 - head * (ux + side * -uy), y2 - head * (uy + side * ux), paint);
  }
  return drawn;
}

}  // namespace

struct Plot::Range {
  double low{std::numeric_limits<double>::infinity()};
  double high{-std::numeric_limits<double>::infinity()};

  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
  // Some air on both sides; a range of one value gets a width.
  void pad() {
    if (!(low <= high)) low = 0.0, high = 1.0;
    const double least = std::max(std::abs(low), std::abs(high)) * 1e-9 + 1e-12;
    const double air = width() > least ? 0.06 * width() : std::max(0.05 * std::abs(low), 1e-6);
    low -= air;
    high += air;
  }
  void widenTo(double width_wanted) {
    const double more = (width_wanted - width()) / 2.0;
    low -= more;
    high += more;
  }
};

// Where the data lie and how they map to the picture.
struct Plot::Frame {
  Range x;
  Range y;
  double height{};  // of the whole picture
  double top{};     // of the axes
  double bottom{};

  double acrossWidth() const { return kWidth - kLeft - kRight; }
  double upHeight() const { return bottom - top; }
  double acrossOf(double value) const { return kLeft + (value - x.low) / x.width() * acrossWidth(); }
  double upOf(double value) const { return bottom - (value - y.low) / y.width() * upHeight(); }
};

std::vector<Point> circleAround(Point centre, double radius) {
  std::vector<Point> points;
  for (int k = 0; k <= 120; ++k) {
    const double angle = kTurn * k / 120.0;
    points.push_back({centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)});
  }
  return points;
}

std::vector<double> ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(wanted, 1);
  if (!(raw > 0.0) || !std::isfinite(raw)) return {low};
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double share = raw / power;
  const double step = power * (share <= 1.0 ? 1.0 : share <= 2.0 ? 2.0 : share <= 5.0 ? 5.0 : 10.0);
  std::vector<double> values;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1.0) values.push_back(k * step);
  if (!values.empty()) return values;
  return wanted < 64 ? ticks(low, high, 2 * std::max(wanted, 1)) : std::vector{low};  // the round step was too long
}

Plot::Plot(std::string title, std::string x_label, std::string y_label)
    : title_{std::move(title)}, x_label_{std::move(x_label)}, y_label_{std::move(y_label)} {}

void Plot::add(std::vector<Point> points, Look look, std::string legend) {
  std::erase_if(points, [](const Point& point) { return !finite(point); });
  if (points.empty()) return;
  if (isLine(look)) points = thinned(points);
  series_.push_back({std::move(points), {}, {}, look, std::move(legend)});
}

void Plot::addWithBars(std::vector<Point> points, const std::vector<double>& bars, Look look, std::string legend) {
  Series series{{}, {}, {}, look, std::move(legend)};
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!finite(points[k])) continue;
    series.points.push_back(points[k]);
    series.bars.push_back(k < bars.size() && std::isfinite(bars[k]) ? bars[k] : 0.0);
  }
  if (!series.points.empty()) series_.push_back(std::move(series));
}

void Plot::addArrows(std::vector<Point> from, std::vector<Point> by, std::string legend) {
  Series series{{}, {}, {}, Look::solid, std::move(legend)};
  for (std::size_t k = 0; k < std::min(from.size(), by.size()); ++k) {
    if (!finite(from[k]) || !finite(by[k])) continue;
    series.points.push_back(from[k]);
    series.arrows.push_back(by[k]);
  }
  if (!series.points.empty()) series_.push_back(std::move(series));
}

void Plot::addLevel(double y, std::string legend) {
  if (!std::isfinite(y)) return;
  const double inf = std::numeric_limits<double>::infinity();
  series_.push_back({{{-inf, y}, {inf, y}}, {}, {}, Look::dotted, std::move(legend)});
}

bool Plot::empty() const {
  return series_.empty();
}

Plot::Frame Plot::frame() const {
  Frame frame;
  for (const auto& point : included_) {
    if (std::isfinite(point.x)) frame.x.include(point.x);
    if (std::isfinite(point.y)) frame.y.include(point.y);
  }
  for (const auto& series : series_) {
    for (std::size_t k = 0; k < series.points.size(); ++k) {
      const Point& at = series.points[k];
      const double bar = series.bars.empty() ? 0.0 : series.bars[k];
      if (std::isfinite(at.x)) frame.x.include(at.x);
      frame.y.include(at.y - bar);
      frame.y.include(at.y + bar);
      if (series.arrows.empty()) continue;
      frame.x.include(at.x + series.arrows[k].x);
      frame.y.include(at.y + series.arrows[k].y);
    }
  }
  frame.x.pad();
  frame.y.pad();
  std::size_t named = 0;
  for (const auto& series : series_) named += series.legend.empty() ? 0 : legendLines(series.legend).size();
  const double more = kLegendLine * static_cast<double>(titleLines(title_).size() - 1);
  frame.top = kTop + more;
  frame.height = (proportional_ ? kSquareHeight : kHeight) + more + kLegendLine * static_cast<double>(named);
  frame.bottom = (proportional_ ? kSquareHeight : kHeight) + more - kBottom;
  if (proportional_) {
    const double scale = std::max(frame.x.width() / frame.acrossWidth(), frame.y.width() / frame.upHeight());
    frame.x.widenTo(scale * frame.acrossWidth());
    frame.y.widenTo(scale * frame.upHeight());
  }
  return frame;
}

std::string Plot::svg() const {
  const Frame frame = this->frame();
  const Paint grid{"var(--grid,#dddddd)", "", 0.7};
  const Paint edge{"var(--ink,#222222)", "", 1.0};
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + pixels(kWidth) + " " +
                     pixels(frame.height) +
                     "\" role=\"img\" font-family=\"sans-serif\" font-size=\"13\" fill=\"var(--ink,#222)\">";
  text += element("title", title_);
  text += "<rect width=\"" + pixels(kWidth) + "\" height=\"" + pixels(frame.height) + "\" fill=\"var(--plot,#fff)\"/>";
  double title_at = 18.0;
  for (const auto& line : titleLines(title_)) {
    text += words(kTitleLeft, title_at, "start", line, " font-size=\"14\" font-weight=\"bold\"");
    title_at += kLegendLine;
  }
  auto across = ticks(frame.x.low, frame.x.high, 6);
  if (counts_) std::erase_if(across, [](double tick) { return std::abs(tick - std::round(tick)) > 1e-6; });
  for (const double tick : across) {
    const double x = frame.acrossOf(tick);
    text += segment(x, frame.top, x, frame.bottom, grid);
    text += words(x, frame.bottom + 16, "middle", tickText(tick, across.size() > 1 ? across[1] - across[0] : 1.0));
  }
  const auto up = ticks(frame.y.low, frame.y.high, proportional_ ? 7 : 5);
  for (const double tick : up) {
    const double y = frame.upOf(tick);
    text += segment(kLeft, y, kWidth - kRight, y, grid);
    text += words(kLeft - 5, y + 4, "end", tickText(tick, up.size() > 1 ? up[1] - up[0] : 1.0));
  }
  text += segment(kLeft, frame.bottom, kWidth - kRight, frame.bottom, edge);
  text += segment(kLeft, frame.top, kLeft, frame.bottom, edge);
  text += words((kLeft + kWidth - kRight) / 2.0, frame.bottom + 36, "middle", x_label_);
  const std::string middle = pixels((frame.top + frame.bottom) / 2.0);
  text += words(15, (frame.top + frame.bottom) / 2.0, "middle", y_label_,
                (" transform=\"rotate(-90 15 " + middle + ")\"").c_str());
  double legend_at = frame.bottom + kBottom + 2.0;
  for (const auto& series : series_) {
    text += draw(series, frame);
    if (series.legend.empty()) continue;
    text += isLine(series.look) ? segment(kLeft, legend_at, kLeft + 22, legend_at, paintOf(series.look))
                                : marker(series.look, kLeft + 11, legend_at);
    for (const auto& line : legendLines(series.legend)) {
      text += words(kLeft + kLegendIndent, legend_at + 4, "start", line);
      legend_at += kLegendLine;
    }
  }
  return text + "</svg>\n";
}

std::string Plot::draw(const Series& series, const Frame& frame) {
  const Paint paint = paintOf(series.look);
  std::string text;
  if (!series.arrows.empty()) {
    for (std::size_t k = 0; k < series.points.size(); ++k) {
      const Point& at = series.points[k];
      text += arrow(frame.acrossOf(at.x), frame.upOf(at.y), frame.acrossOf(at.x + series.arrows[k].x),
                    frame.upOf(at.y + series.arrows[k].y), paint);
    }
    return text;
  }
  if (isLine(series.look)) {
    text = "<polyline fill=\"none\" " + stroke(paint) + " points=\"";
    for (const auto& at : series.points) {
      const double x = std::clamp(frame.acrossOf(at.x), kLeft, kWidth - kRight);
      text += pixels(x) + "," + pixels(frame.upOf(at.y)) + " ";
    }
    return text + "\"/>";
  }
  for (std::size_t k = 0; k < series.points.size(); ++k) {
    const double x = frame.acrossOf(series.points[k].x);
    const double y = series.points[k].y;
    const double bar = series.bars.empty() ? 0.0 : series.bars[k];
    if (bar > 0.0) text += segment(x, frame.upOf(y - bar), x, frame.upOf(y + bar), paint);
    text += marker(series.look, x, frame.upOf(y));
  }
  return text;
}

}  // namespace probebox::report
