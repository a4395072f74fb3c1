#include "tools/gcode/dialect.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>

namespace probebox::gcode {
namespace {

constexpr std::array<std::string_view, 4> kNames{"linuxcnc", "fanuc", "siemens", "haas"};

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

std::string Dialect::move(const Move& move) const {
  if (move.arc) {
    return (move.arc->clockwise ? "G2 X" : "G3 X") + decimal(move.to_mm.x()) + " Y" + decimal(move.to_mm.y()) + " I" +
           decimal(move.arc->to_centre_mm.x()) + " J" + decimal(move.arc->to_centre_mm.y()) + " F" +
           decimal(move.feed_mm_min);
  }
  std::string words = "G1";
  if (!move.z_only) words += " X" + decimal(move.to_mm.x()) + " Y" + decimal(move.to_mm.y());
  return words + " Z" + decimal(move.to_mm.z()) + " F" + decimal(move.feed_mm_min);
}

std::string Dialect::turn(const Turn& turn) const {
  std::string words = "G0";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (turn.used[axis]) words += std::string{" "} + "ABC"[axis] + decimal(turn.to_deg[axis]);
  }
  return words;
}

std::vector<std::string> Dialect::take(const TakeTool& tool) const {
  if (tool.number == 0) return {comment("THE PROBE IS IN THE SPINDLE, ITS LENGTH OFFSET ACTIVE")};
  const std::string number = std::to_string(tool.number);
  return {"T" + number + " M6", "G43 H" + number};
}

std::string Dialect::wait(double s) const {
  return "G4 P" + decimal(s);
}

std::vector<std::string> Dialect::stop(std::string_view text) const {
  return {comment(text), "M0"};
}

const Dialect* dialectNamed(std::string_view name) {
  for (const Dialect* one : {&linuxcnc(), &fanuc(), &siemens(), &haas()}) {
    if (one->name() == name) return one;
  }
  return nullptr;
}

std::span<const std::string_view> dialectNames() {
  return kNames;
}

}  // namespace probebox::gcode
