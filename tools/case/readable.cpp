#include "tools/case/readable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string_view>
#include <utility>

#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/methods.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::casefolder {
namespace {

std::string plain(double value, int digits = 9) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

constexpr std::string_view kMeasuredAt = "measured_at_s", kUtc = "UTC";

std::string timeText(double seconds) {
  if (seconds == 0) return "unknown";  // the box had no clock that it could trust
  const auto at = static_cast<std::time_t>(seconds);
  std::tm utc{};
  std::array<char, 40> text{};
  if (gmtime_r(&at, &utc) == nullptr || std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &utc) == 0)
    return plain(seconds);
  return text.data();
}

// Beyond what a double resolves digits would be made up: three hundred of them for the largest.
std::string fixed(double value, int decimals) {
  constexpr double kResolved = 1e15;
  if (std::abs(value) >= kResolved) return plain(value);
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, "%.*f", decimals, value)), '\0');
  std::snprintf(text.data(), text.size() + 1, "%.*f", decimals, value);
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return zero && text.starts_with('-') ? text.substr(1) : text;
}

metrology::QuantityKind kindOf(std::string_view key) {
  const auto* quantity = metrology::quantityOf(key);
  return quantity == nullptr ? metrology::QuantityKind::plain : quantity->kind;
}

// So many that an uncertainty has two digits.
int decimalsOf(double uncertainty) {
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(uncertainty))), 0, 12);
}

}  // namespace

bool isError(std::string_view key) {
  const auto kind = kindOf(key);
  return kind == metrology::QuantityKind::error || kind == metrology::QuantityKind::offset;
}

bool hasIdealZero(std::string_view key) {
  const auto quantity = key.substr(0, key.find('['));  // a component is of the kind of the whole
  return isError(quantity) || kindOf(quantity) == metrology::QuantityKind::lean;
}

bool zeroByDefinition(const metrology::Estimate& estimate, std::size_t k) {
  if (k >= estimate.sd.size() || estimate.values[k] != 0.0 || estimate.sd[k] != 0.0) return false;
  const bool certain = k >= estimate.uncertainty.size() || estimate.uncertainty[k] == 0.0;
  return certain && std::ranges::any_of(estimate.sd, [](double sd) { return sd > 0.0; });
}

namespace {

// Named as its key is, without the unit.
Label labelByKey(std::string_view key) {
  if (key == kMeasuredAt) return {"measured_at", std::string{kUtc}, 1.0};
  const auto ends = [&](std::string_view suffix) { return key.ends_with(suffix); };
  const auto without = [&](std::string_view suffix) { return std::string{key.substr(0, key.size() - suffix.size())}; };
  if (ends("_mm_s")) return {without("_mm_s"), "mm/s", 1.0};
  if (ends("_um_s")) return {without("_um_s"), "um/s", 1.0};
  if (ends("_um_per_min")) return {without("_um_per_min"), "um/min", 1.0};
  if (ends("_per_mm")) return {without("_per_mm"), "1/mm", 1.0};
  if (ends("_hz")) return {without("_hz"), "Hz", 1.0};
  const auto kind = kindOf(key);
  const bool is_error = kind == metrology::QuantityKind::error;
  if (ends("_mm")) return is_error ? Label{without("_mm"), "um", 1e3} : Label{without("_mm"), "mm", 1.0};
  if (ends("_um")) return {without("_um"), "um", 1.0};
  if (ends("_rad"))
    return is_error || kind == metrology::QuantityKind::lean ? Label{without("_rad"), "urad", 1e6}
                                                             : Label{without("_rad"), "deg", 1 / kDegree};
  if (ends("_s")) return {without("_s"), "us", 1e6};
  return {std::string{key}, "", 1.0};
}

}  // namespace

Label labelOf(std::string_view key) {
  const auto index = std::min(key.find('['), key.size());
  const auto stem = key.substr(0, index);
  Label label = labelByKey(stem);
  if (const auto* known = metrology::quantityOf(stem); known != nullptr && !known->name.empty())
    label.name = known->name;
  label.name += key.substr(index);
  return label;
}

std::string valueText(const Label& label, double value, std::optional<double> sd) {
  const double shown = value * label.factor;
  if (label.unit == kUtc) return timeText(shown);
  const bool known = sd && *sd > 0.0 && std::isfinite(*sd);
  return known ? fixed(shown, decimalsOf(*sd * label.factor)) : plain(shown);
}

std::string withUncertainty(const Label& label, double value, std::optional<double> u) {
  const std::string tail = label.unit.empty() ? "" : " " + label.unit;
  const bool known = u && *u > 0.0 && std::isfinite(*u);
  const std::string text = valueText(label, value, u);
  if (!known) return text + tail;
  const double shown = *u * label.factor;
  return text + " +/- " + fixed(shown, decimalsOf(shown)) + tail;
}

std::string withUnit(const Label& label, double uncertainty) {
  const double shown = uncertainty * label.factor;
  const std::string tail = label.unit.empty() ? "" : " " + label.unit;
  constexpr double kNothing = 1e-12;  // more places are not shown
  if (shown >= 0.0 && shown < kNothing) return "0" + tail;
  if (!(shown > 0.0) || !std::isfinite(shown)) return plain(shown) + tail;
  return fixed(shown, decimalsOf(shown)) + tail;
}

std::string shareText(const Label& label, double share, double whole) {
  constexpr double kNil = 1e-6;  // of the whole: what rounding leaves of nothing
  return withUnit(label, share <= kNil * whole ? 0.0 : share);
}

std::string chiSquareText(const metrology::Result& result) {
  const std::string value = "reduced chi-square " + plain(result.chi2_reduced.value_or(0.0), 3);
  const auto law = metrology::lawOf(result);
  if (!law) return value;
  const auto [low, high] = metrology::expectedRange(*law);
  return value + " at " + std::to_string(law->dof) + (law->dof == 1 ? " degree" : " degrees") +
         " of freedom (99.9 % of honest readings: " + plain(low, 2) + " to " + plain(high, 2) + ")";
}

std::string ofAReading(double value, const std::string& unit) {
  if (unit == "mm") return plain(1e3 * value, 3) + " um";
  if (unit == "rad") return plain(1e6 * value, 3) + " urad";
  return plain(value, 3) + (unit.empty() ? "" : " " + unit);
}

std::string typeset(std::string_view text) {
  constexpr std::string_view kMicro = "\u00b5", kPlusMinus = "\u00b1";
  constexpr std::array<std::string_view, 3> kUnits{"um", "us", "urad"};
  const auto isLetter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto mayBegin = [&](std::size_t at) {
    if (at == 0) return true;
    if (text[at - 1] == '(') return true;
    return at >= 2 && text[at - 1] == ' ' && text[at - 2] >= '0' && text[at - 2] <= '9';
  };
  std::string all;
  for (std::size_t at = 0; at < text.size();) {
    const auto rest = text.substr(at);
    if (rest.starts_with("+/-")) {
      all += kPlusMinus;
      at += 3;
      continue;
    }
    const auto* unit = std::ranges::find_if(kUnits, [&](std::string_view one) {
      if (!rest.starts_with(one)) return false;
      const bool ends = rest.size() == one.size() || !isLetter(rest[one.size()]);
      // A unit alone is a label, such as "um" or "um/min"; a sentence does not begin with one.
      const bool alone = at != 0 || rest.size() == one.size() || rest[one.size()] == '/';
      return ends && alone;
    });
    if (unit != kUnits.end() && mayBegin(at)) {
      all += kMicro;
      ++at;
      continue;
    }
    all += text[at++];
  }
  return all;
}

std::string designText(const std::string& key, double figure, const std::string& design_per) {
  const Label label = labelOf(key);
  const auto comma = design_per.rfind(", ");
  const std::string reading = design_per.substr(0, comma);
  const std::string unit = comma == std::string::npos ? "" : design_per.substr(comma + 2);
  if (unit == label.unit || key.ends_with("_" + unit))
    return label.name + " is " + plain(figure, 3) + " times that of " + reading;
  // Nobody measures to millimetres or radians.
  const bool length = unit == "mm", angle = unit == "rad";
  const double shown = figure * label.factor * (length ? 1e-3 : angle ? 1e-6 : 1.0);
  const std::string fine = length ? "um" : angle ? "urad" : unit;
  const std::string in_unit = label.unit.empty() ? "" : " " + label.unit;
  return label.name + " is " + plain(shown, 3) + in_unit + " per " + fine + " of " + reading;
}

}  // namespace probebox::casefolder
