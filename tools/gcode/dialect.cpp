#include "tools/gcode/dialect.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>

namespace probebox::gcode {
namespace {

std::array<const Dialect*, 6> dialects() {
  return {&linuxcnc(), &fanuc(), &fanucLathe(), &siemens(), &siemensLathe(), &haas()};
}

}  // namespace

std::string decimal(double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.3f", value);
  return std::string_view{text.data()} == "-0.000" ? "0.000" : text.data();
}

std::string plain(std::string_view text) {
  std::string all;
  for (const char c : text) {
    if (c == '(' || c == ')' || c == '[' || c == ']' || c == '%' || c == ';' || c == '"') {
      all += ' ';
    } else if (c >= ' ' && c <= '~') {
      all += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  return all;
}

std::string nameOf(const Mark& mark) {
  return mark.begin ? "BEGIN" : "END";
}

std::string Dialect::comment(std::string_view text) const {
  return "(" + plain(text) + ")";
}

std::string Dialect::machines() const {
  return "For machining centres, not for lathes: no " + std::string{lathe()} + ", no diameters in X, no turret.";
}

std::string Dialect::placeWords(const Move& move) const {
  std::string words;
  if (move.axes != Move::Axes::z) words += " X" + decimal(xFactor() * move.to_mm.x());
  if (move.axes != Move::Axes::z && !isLathe()) words += " Y" + decimal(move.to_mm.y());
  if (move.axes != Move::Axes::xy) words += " Z" + decimal(move.to_mm.z());
  return words;
}

std::string Dialect::retracting(double machine_z_mm) const {
  return "Z rises to " + decimal(machine_z_mm) + " in machine coordinates at rapid";
}

bool isAxisWord(std::string_view word) {
  if (word.empty() || std::string_view{"ABCUVW"}.find(word.front()) == std::string_view::npos) return false;
  if (word.size() == 1) return true;
  const auto number = word.substr(1, word.size() - 2);
  return word.back() == '=' && std::ranges::all_of(number, [](unsigned char c) { return std::isdigit(c) != 0; });
}

std::string Dialect::move(const Move& move) const {
  if (move.arc) {
    return (move.arc->clockwise ? "G2 X" : "G3 X") + decimal(move.to_mm.x()) + " Y" + decimal(move.to_mm.y()) + " I" +
           decimal(move.arc->to_centre_mm.x()) + " J" + decimal(move.arc->to_centre_mm.y()) + " F" +
           decimal(move.feed_mm_min);
  }
  return "G1" + placeWords(move) + " F" + decimal(move.feed_mm_min);
}

Dialect::Lines Dialect::moveBy(const Eigen::Vector3d& by_mm, double feed_mm_min) const {
  return {"G91", "G1" + placeWords({.to_mm = by_mm}) + " F" + decimal(feed_mm_min), "G90"};
}

std::string Dialect::orient(double angle_deg) const {
  return "M19 R" + decimal(angle_deg);
}

Dialect::Lines Dialect::turn(const Turn& turn, const Words& words) const {
  Lines lines;
  std::string together;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!turn.used[axis]) continue;
    const std::string& word = words[axis];
    if (isAxisWord(word)) {
      together += " " + word + decimal(turn.to_deg[axis]);
      continue;
    }
    double orientation_deg = std::fmod(turn.to_deg[axis], 360);
    if (orientation_deg < 0) orientation_deg += 360;
    lines.push_back(word.empty() ? orient(orientation_deg) : word + decimal(orientation_deg));
  }
  if (!together.empty())
    lines.push_back(turn.feed_deg_min ? "G1" + together + " F" + decimal(*turn.feed_deg_min) : "G0" + together);
  return lines;
}

Dialect::Lines Dialect::take(const TakeTool& tool) const {
  return {"T" + std::to_string(tool.number) + " M6"};
}

Dialect::Lines Dialect::takeAnew(const TakeTool& tool) const {
  Lines lines = take(tool);
  const Lines restated = modes();
  lines.insert(lines.end(), restated.begin(), restated.end());
  return lines;
}

std::string Dialect::wait(double s) const {
  return "G4 P" + decimal(s);
}

const Dialect* dialectNamed(std::string_view name) {
  for (const Dialect* one : dialects()) {
    if (one->name() == name) return one;
  }
  return nullptr;
}

std::span<const std::string_view> dialectNames() {
  static const auto names = [] {
    const auto all = dialects();
    std::array<std::string_view, all.size()> each;
    std::ranges::transform(all, each.begin(), &Dialect::name);
    return each;
  }();
  return names;
}

}  // namespace probebox::gcode
