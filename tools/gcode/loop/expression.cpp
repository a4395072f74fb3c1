#include "tools/gcode/loop/expression.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <utility>
#include <vector>

namespace probebox::gcode::loop {
namespace {

constexpr int kFirstTable = 1000;  // numbers of parameters that are tables of places
constexpr int kToolInSpindle = 5400;
// By rising precedence.
const std::array<std::vector<std::string_view>, 4> kOperators{
    {{"AND", "OR"}, {"EQ", "NE", "LE", "LT", "GE", "GT"}, {"+", "-"}, {"*", "/", "MOD"}}};

Error unreadable(std::string_view at) {
  return Error{"cannot be read here: \"" + std::string{at} + "\""};
}

}  // namespace

void Reader::skip() {
  while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
}

bool Reader::atEnd() {
  skip();
  return rest_.empty();
}

bool Reader::take(std::string_view text) {
  skip();
  if (!rest_.starts_with(text)) return false;
  rest_.remove_prefix(text.size());
  return true;
}

char Reader::letter() {
  skip();
  if (rest_.empty() || std::isupper(static_cast<unsigned char>(rest_.front())) == 0) return 0;
  const char letter = rest_.front();
  rest_.remove_prefix(1);
  return letter;
}

std::string Reader::operatorOf(int level) {
  for (const auto name : kOperators.at(static_cast<std::size_t>(level))) {
    if (take(name)) return std::string{name};
  }
  return {};
}

Outcome<Value> Reader::operation(int level) {
  if (level == static_cast<int>(kOperators.size())) return value();
  auto left = operation(level + 1);
  if (!left) return left;
  for (auto name = operatorOf(level); !name.empty(); name = operatorOf(level)) {
    auto right = operation(level + 1);
    if (!right) return right;
    left = Value{.is = Value::Is::operation, .name = name, .arguments = {std::move(*left), std::move(*right)}};
  }
  return left;
}

Outcome<Value> Reader::value() {
  skip();
  if (rest_.empty()) return unreadable("the end of the line");
  if (take("[")) {
    auto inner = operation(0);
    if (!inner) return inner;
    if (!take("]")) return unreadable(rest_);
    return inner;
  }
  if (take("#")) return parameter();
  if (std::isalpha(static_cast<unsigned char>(rest_.front())) != 0) return function();
  return number();
}

Outcome<Value> Reader::number() {
  Value value;
  const auto [end, failure] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value.number);
  if (failure != std::errc{}) return unreadable(rest_);
  rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
  return value;
}

Outcome<Value> Reader::parameter() {
  if (take("<")) {
    const auto end = rest_.find('>');
    if (end == std::string_view::npos) return unreadable(rest_);
    const std::string name{rest_.substr(0, end)};
    rest_.remove_prefix(end + 1);
    if (name.starts_with("_hal[")) return Value{.is = Value::Is::pin, .name = name.substr(5, name.size() - 6)};
    return Value{.is = Value::Is::variable, .name = name.starts_with('_') ? name : owner_ + "/" + name};
  }
  auto which = value();
  if (!which) return which;
  if (which->is != Value::Is::number) return Value{.is = Value::Is::table, .arguments = {std::move(*which)}};
  const int number = static_cast<int>(which->number);
  if (number == kToolInSpindle) return Value{.is = Value::Is::variable, .name = "_tool"};
  if (number >= kFirstTable) return Value{.is = Value::Is::table, .arguments = {std::move(*which)}};
  return Value{.is = Value::Is::variable, .name = owner_ + "/" + std::to_string(number)};
}

Outcome<Value> Reader::function() {
  for (const std::string_view name : {"ABS", "FIX", "SQRT", "SIN", "COS", "ROUND"}) {
    if (!take(name)) continue;
    auto argument = value();
    if (!argument) return argument;
    return Value{.is = Value::Is::call, .name = std::string{name}, .arguments = {std::move(*argument)}};
  }
  return unreadable(rest_);
}

}  // namespace probebox::gcode::loop
