#include "tools/fleet/metrics/exposition.hpp"

#include <charconv>
#include <cmath>

#include "protocol/units/wording.hpp"

namespace probebox::fleet {
namespace {

std::string escaped(std::string_view text, bool in_quotes) {
  std::string all;
  for (const char c : text) {
    if (c == '\\' || (c == '"' && in_quotes)) all += '\\';
    all += c;
  }
  return all;
}

std::string numberText(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  return {digits, end};
}

// A label of a box or a file may hold line breaks and bytes that are not UTF-8, which shown() replaces.
std::string seriesName(const std::string& name, const std::vector<Label>& labels) {
  std::string all = name;
  for (const auto& label : labels)
    all += (&label == labels.data() ? "{" : ",") + label.name + "=\"" + escaped(shown(label.value), true) + '"';
  return labels.empty() ? all : all + "}";
}

}  // namespace

void Exposition::add(const std::string& name, std::string_view help, MetricType type, const std::vector<Label>& labels,
                     double value) {
  const auto series = seriesName(name, labels);
  if (!written_.insert(series).second) return;
  const auto [known, is_new] = known_.try_emplace(name, families_.size());
  if (is_new) {
    families_.push_back("# HELP " + name + " " + escaped(shown(help), false) + "\n# TYPE " + name +
                        (type == MetricType::counter ? " counter\n" : " gauge\n"));
  }
  families_[known->second] += series + " " + numberText(value) + "\n";
}

std::string Exposition::text() const {
  std::string all;
  for (const auto& family : families_) all += family;
  return all;
}

}  // namespace probebox::fleet
