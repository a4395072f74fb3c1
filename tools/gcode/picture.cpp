#include "tools/gcode/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tools/gcode/dialect.hpp"
#include "tools/gcode/points_of.hpp"
#include "tools/gcode/unroll.hpp"

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;

constexpr double kWidth = 460, kMargin = 50, kTop = 70;

// One of the two views: which axis goes up the page.
struct View {
  Eigen::Index up{};
  const char* title{};
  double left{};
};

struct Frame {
  Vector3d least{Vector3d::Constant(1e9)}, most{Vector3d::Constant(-1e9)};
  double scale{1};

  void add(const Blocks& blocks) {
    std::optional<Vector3d> here;
    for (const auto& block : blocks) {
      const auto* move = std::get_if<Move>(&block);
      if (move == nullptr || !knowsPlace(*move)) continue;
      for (const auto& point : pointsOf(*move, here.value_or(move->to_mm))) {
        least = least.cwiseMin(point);
        most = most.cwiseMax(point);
      }
      here = move->to_mm;
    }
    const double widest = std::max({(most - least).maxCoeff(), 1.0});
    scale = (kWidth - kMargin) / widest;
  }
  double height() const { return std::max(most.y() - least.y(), most.z() - least.z()) * scale; }
  std::string point(const View& view, const Vector3d& at) const {
    return decimal(x(view, at.x())) + "," + decimal(y(view, at[view.up]));
  }
  double x(const View& view, double at) const { return view.left + (at - least.x()) * scale; }
  double y(const View& view, double at) const { return kTop + (most[view.up] - at) * scale; }
};

const char* colourOf(Way way) {
  switch (way) {
    case Way::level:
      return "#8a8a8a";
    case Way::traverse:
      return "#1f6fb2";
    case Way::near:
      return "#d08a00";
    case Way::measure:
      return "#c02020";
  }
  return "#000000";
}

std::string text(double x, double y, std::string_view words, const char* more = "") {
  return "<text x=\"" + decimal(x) + "\" y=\"" + decimal(y) + "\" " + more + ">" + std::string{words} + "</text>\n";
}

std::string line(const std::string& from, const std::string& to, const char* colour, const char* more) {
  return "<polyline points=\"" + from + " " + to + "\" fill=\"none\" stroke=\"" + colour + "\" " + more + "/>\n";
}

std::string pathOf(const Blocks& blocks, const Frame& frame, const View& view, const char* more, bool coloured) {
  std::string all;
  std::optional<Vector3d> here;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    if (move == nullptr || !knowsPlace(*move)) continue;
    if (here) {
      std::string points;
      for (const auto& point : pointsOf(*move, *here)) points += (points.empty() ? "" : " ") + frame.point(view, point);
      all += line(frame.point(view, *here), points, coloured ? colourOf(move->way) : "#c8c8c8", more);
    }
    here = move->to_mm;
  }
  return all;
}

// Numbers where steps begin: steps at one point share a label.
std::string stepsOf(const Blocks& blocks, const Frame& frame, const View& view) {
  std::string all;
  Vector3d here = Vector3d::Zero();
  std::vector<std::string> labelled;
  for (const auto& block : blocks) {
    if (const auto* move = std::get_if<Move>(&block)) here = move->to_mm;
    const auto* mark = std::get_if<Mark>(&block);
    if (mark == nullptr || !mark->begin) continue;
    const std::string at = frame.point(view, here);
    if (std::ranges::find(labelled, at) != labelled.end()) continue;
    labelled.push_back(at);
    all += text(frame.x(view, here.x()) + 2, frame.y(view, here[view.up]) - 2, std::to_string(mark->step + 1),
                "font-size=\"8\"");
  }
  return all;
}

std::string axesOf(const Frame& frame, const View& view, double height) {
  const std::string across = "X " + decimal(frame.least.x()) + " to " + decimal(frame.most.x()) + " mm";
  const std::string up =
      std::string{"XYZ"[view.up]} + " " + decimal(frame.least[view.up]) + " to " + decimal(frame.most[view.up]) + " mm";
  return text(view.left, kTop - 24, view.title, "font-weight=\"bold\"") + text(view.left, kTop + height + 22, across) +
         text(view.left, kTop + height + 38, up);
}

std::string legend(double y) {
  struct Entry {
    const char *colour, *words;
  };
  static constexpr std::array<Entry, 5> kEntries{{{"#8a8a8a", "at the safe height"},
                                                  {"#1f6fb2", "traverse"},
                                                  {"#d08a00", "near the surface"},
                                                  {"#c02020", "measuring speed"},
                                                  {"#c8c8c8", "dry run"}}};
  std::string all;
  double x = kMargin;
  for (const auto& [colour, words] : kEntries) {
    all += "<rect x=\"" + decimal(x) + "\" y=\"" + decimal(y - 8) + "\" width=\"14\" height=\"8\" fill=\"" + colour +
           "\"/>\n" + text(x + 18, y, words);
    x += 165;
  }
  return all;
}

}  // namespace

std::string picture(const Blocks& blocks, const Setting& setting, std::string_view title) {
  const Blocks dry = dryRun(blocks, liftOfDryRun(blocks, *setting.safe_z_mm));
  Frame frame;
  frame.add(blocks);
  frame.add(dry);
  const double height = frame.height();
  const std::array views{View{1, "from above: X right, Y up", kMargin},
                         View{2, "from the front: X right, Z up", kMargin + kWidth}};
  std::string all = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + decimal(2 * kWidth + kMargin) +
                    "\" height=\"" + decimal(kTop + height + 90) + "\" font-family=\"sans-serif\" font-size=\"11\">\n" +
                    "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
                    text(kMargin, 24, title, "font-size=\"15\"");
  for (const View& view : views) {
    all += pathOf(dry, frame, view, "stroke-width=\"0.8\"", false);
    all += pathOf(blocks, frame, view, "stroke-width=\"1.2\"", true);
    all += stepsOf(blocks, frame, view) + axesOf(frame, view, height);
  }
  const double safe_y = frame.y(views[1], *setting.safe_z_mm);
  all += line(decimal(views[1].left) + "," + decimal(safe_y),
              decimal(views[1].left + kWidth - kMargin) + "," + decimal(safe_y), "#208020", "stroke-dasharray=\"6 3\"");
  all += text(views[1].left, safe_y - 3, "safe height Z " + decimal(*setting.safe_z_mm));
  return all + legend(kTop + height + 70) + "</svg>\n";
}

}  // namespace probebox::gcode
