#include "formula.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "control.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::scenario {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kSigns{{{" EQ ", "="},
                                                                                {" NE ", "!"},
                                                                                {" LE ", "l"},
                                                                                {" LT ", "<"},
                                                                                {" GE ", "g"},
                                                                                {" GT ", ">"},
                                                                                {"==", "="},
                                                                                {"<>", "!"},
                                                                                {"<=", "l"},
                                                                                {">=", "g"},
                                                                                {"<", "<"},
                                                                                {">", ">"}}};

std::optional<double> functionOf(std::string_view name, double x) {
  if (name == "ABS") return std::abs(x);
  if (name == "FIX" || name == "TRUNC") return std::trunc(x);
  if (name == "ROUND") return std::round(x);
  if (name == "SQRT") return std::sqrt(x);
  if (name == "SIN") return std::sin(x * kDegree);
  if (name == "COS") return std::cos(x * kDegree);
  return std::nullopt;
}

}  // namespace

void Formula::skip() {
  while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
}

bool Formula::take(std::string_view text) {
  skip();
  if (!rest_.starts_with(text)) return false;
  rest_.remove_prefix(text.size());
  return true;
}

double Formula::value() {
  const double all = sum();
  skip();
  if (!rest_.empty()) throw Alarm{"too much in a formula: " + std::string{rest_}};
  return all;
}

double Formula::sum() {
  double left = product();
  while (true) {
    if (take("+")) {
      left += product();
    } else if (take("-")) {
      left -= product();
    } else {
      return left;
    }
  }
}

double Formula::product() {
  double left = primary();
  while (true) {
    if (take("*")) {
      left *= primary();
    } else if (take("/")) {
      left /= primary();
    } else if (take("B_AND")) {
      left = static_cast<double>(static_cast<std::int64_t>(left) & static_cast<std::int64_t>(primary()));
    } else {
      return left;
    }
  }
}

double Formula::inBrackets(char closing) {
  const double inner = sum();
  if (!take(std::string_view{&closing, 1})) throw Alarm{"a bracket is open: " + std::string{rest_}};
  return inner;
}

double Formula::primary() {
  if (take("-")) return -primary();
  if (take("[")) return inBrackets(']');
  if (take("(")) return inBrackets(')');
  if (take("#")) return known_("#", primary());
  if (!rest_.empty() && (std::isalpha(static_cast<unsigned char>(rest_.front())) != 0 || rest_.front() == '$'))
    return named();
  double number = 0;
  const auto [end, failure] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), number);
  if (failure != std::errc{}) throw Alarm{"no value: " + std::string{rest_}};
  rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
  return number;
}

double Formula::named() {
  std::size_t length = 1;
  while (length < rest_.size() &&
         (std::isalnum(static_cast<unsigned char>(rest_[length])) != 0 || rest_[length] == '_'))
    ++length;
  const std::string name{rest_.substr(0, length)};
  rest_.remove_prefix(length);
  if (name == "$AA_IM") {
    const std::string axis = name + rest_.at(1);
    rest_.remove_prefix(3);
    return known_(axis, 0);
  }
  const bool bracket = take("[");
  if (!bracket && !take("(")) return known_(name, 0);
  const double inner = inBrackets(bracket ? ']' : ')');
  if (const auto result = functionOf(name, inner)) return *result;
  return known_(name, inner);
}

bool holds(std::string_view condition, const Formula::Known& known) {
  for (const auto& [sign, means] : kSigns) {
    const auto at = condition.find(sign);
    if (at == std::string_view::npos) continue;
    const double a = Formula{condition.substr(0, at), known}.value();
    const double b = Formula{condition.substr(at + sign.size()), known}.value();
    if (means == "=") return a == b;
    if (means == "!") return a != b;
    if (means == "<") return a < b;
    if (means == ">") return a > b;
    return means == "l" ? a <= b : a >= b;
  }
  throw Alarm{"no condition: " + std::string{condition}};
}

}  // namespace probebox::scenario
