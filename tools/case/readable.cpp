#include "tools/case/readable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::casefolder {
namespace {

std::string fixed(double value, int decimals) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, "%.*f", decimals, value)), '\0');
  std::snprintf(text.data(), text.size() + 1, "%.*f", decimals, value);
  return text;
}

std::string plain(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

}  // namespace

Label labelOf(const std::string& key) {
  const auto ends = [&](std::string_view suffix) { return key.ends_with(suffix); };
  const auto without = [&](std::string_view suffix) { return key.substr(0, key.size() - suffix.size()); };
  if (ends("_mm_s")) return {without("_mm_s"), "mm/s", 1.0};
  if (ends("_um_s")) return {without("_um_s"), "um/s", 1.0};
  if (ends("_mm")) return {without("_mm"), "mm", 1.0};
  if (ends("_um")) return {without("_um"), "um", 1.0};
  if (ends("_rad")) return {without("_rad"), "rad", 1.0};
  if (ends("_s")) return {without("_s"), "us", 1e6};
  return {key, "", 1.0};
}

std::string withSd(const Label& label, double value, std::optional<double> sd) {
  const std::string tail = label.unit.empty() ? "" : " " + label.unit;
  const double shown = value * label.factor;
  if (!sd || !(*sd > 0.0) || !std::isfinite(*sd)) return plain(shown) + tail;
  const double shown_sd = *sd * label.factor;
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(shown_sd))), 0, 12);
  return fixed(shown, decimals) + " +/- " + fixed(shown_sd, decimals) + tail;
}

}  // namespace probebox::casefolder
