#include "tools/gcode/loop/program_text.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/loop/value.hpp"

namespace probebox::gcode::loop {
namespace {

// Reads values from one line in the language of LinuxCNC.
class Reader {
 public:
  // subprogram: owner of its variables.
  Reader(std::string_view line, std::string subprogram) : rest_{line}, owner_{std::move(subprogram)} {}

  // "[...]", "#3", "#<name>", "12.5", "ABS[...]".
  Outcome<Value> value();
  bool atEnd();
  bool take(std::string_view text);  // skips spaces first
  char letter();                     // of a word; 0 for anything else
  std::string_view rest() const { return rest_; }

 private:
  Outcome<Value> operation(int level);
  Outcome<Value> number();
  Outcome<Value> parameter();
  Outcome<Value> function();
  std::string operatorOf(int level);
  void skip();

  std::string_view rest_;
  std::string owner_;
};

constexpr int kFirstTable = 1000;  // numbers of parameters that are tables of places
constexpr int kToolInSpindle = 5400;
// By rising precedence.
const std::array<std::vector<std::string_view>, 4> kOperators{
    {{"AND", "OR"}, {"EQ", "NE", "LE", "LT", "GE", "GT"}, {"+", "-"}, {"*", "/", "MOD"}}};

Error unreadable(std::string_view at) {
  return Error{"cannot be read here: \"" + std::string{at} + "\""};
}

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

constexpr std::string_view kPrefix = "probebox_";

std::string_view trimmed(std::string_view line) {
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
  return line;
}

// Reads subprograms line by line. What is open is a stack of bodies; the statement that has one open waits in the body
// below it.
class Program {
 public:
  Outcome<std::vector<Subprogram>> read(std::string_view source) {
    std::size_t number = 0;
    while (!source.empty()) {
      ++number;
      const auto end = std::min(source.find('\n'), source.size());
      if (auto error = line(trimmed(source.substr(0, end))))
        return Error{"line " + std::to_string(number) + ": " + error->what};
      source.remove_prefix(std::min(source.size(), end + 1));
    }
    if (!open_.empty()) return Error{"the end of " + name_ + " is missing"};
    return std::move(done_);
  }

 private:
  using Failure = std::optional<Error>;

  Failure line(std::string_view text) {
    if (text.empty()) return std::nullopt;
    if (text.front() == ';') return comment(text.substr(1));
    if (text.front() == '(') return active(text.substr(1, text.size() - 2));
    if (const auto behind = text.find(';'); behind != std::string_view::npos) {
      note_ = trimmed(text.substr(behind + 1));
      text = trimmed(text.substr(0, behind));
    } else {
      note_ = {};
    }
    if (text.front() == 'o') return oWord(text.substr(1));
    if (open_.empty()) return Error{"a block outside of a subprogram"};
    return text.front() == '#' ? assign(text) : block(text);
  }

  Failure comment(std::string_view text) {
    Statement statement{.is = Statement::Is::comment, .text = std::string{trimmed(text)}};
    if (open_.empty()) {
      before_.push_back(std::move(statement));
    } else {
      add(std::move(statement));
    }
    return std::nullopt;
  }

  Failure active(std::string_view text) {
    const auto comma = text.find(',');
    const auto what = text.substr(0, comma);
    if (comma == std::string_view::npos) return comment(text);
    const auto said = std::string{trimmed(text.substr(comma + 1))};
    if (what == "MSG") return add({.is = Statement::Is::message, .text = said});
    if (what == "ABORT") return add({.is = Statement::Is::abort, .text = said});
    return Error{"an unknown active comment: " + std::string{what}};
  }

  Failure assign(std::string_view text) {
    Reader reader{text, name_};
    auto target = reader.value();
    if (!target) return target.error();
    if (!reader.take("=")) return Error{"= is missing"};
    auto value = reader.value();
    if (!value) return value.error();
    if (!reader.atEnd()) return Error{"too much: " + std::string{reader.rest()}};
    return add(
        {.is = Statement::Is::assign, .text = std::string{note_}, .values = {std::move(*target), std::move(*value)}});
  }

  Failure block(std::string_view text) {
    Reader reader{text, name_};
    Statement statement{.is = Statement::Is::block, .text = std::string{text}};
    while (!reader.atEnd()) {
      const char letter = reader.letter();
      if (letter == 0) return Error{"no word: " + std::string{reader.rest()}};
      auto value = reader.value();
      if (!value) return value.error();
      statement.words.push_back({letter, std::move(*value)});
    }
    return add(std::move(statement));
  }

  Failure oWord(std::string_view text) {
    const bool named = text.starts_with("<");
    const auto end = named ? text.find('>') + 1 : text.find(' ');
    std::string_view label = text.substr(named ? 1 : 0, named ? end - 2 : end);
    if (label.starts_with(kPrefix)) label.remove_prefix(kPrefix.size());
    Reader reader{text.substr(end), name_};
    if (named) return ofSubprogram(std::string{label}, reader);
    return ofFlow(reader);
  }

  Failure ofSubprogram(const std::string& label, Reader& reader) {
    if (reader.take("sub")) {
      name_ = label;
      open_.push_back(std::move(before_));
      before_.clear();
      return std::nullopt;
    }
    if (reader.take("call")) {
      Statement call{.is = Statement::Is::call, .text = label};
      while (!reader.atEnd()) {
        auto argument = reader.value();
        if (!argument) return argument.error();
        call.values.push_back(std::move(*argument));
      }
      return add(std::move(call));
    }
    const bool ends = reader.take("endsub");
    if (!ends && !reader.take("return")) return Error{"sub, call, return or endsub is missing"};
    if (!reader.atEnd()) {
      auto value = reader.value();
      if (!value) return value.error();
      add({.is = Statement::Is::give, .values = {std::move(*value)}});
    } else if (!ends) {
      return Error{"a return without a value"};
    }
    if (!ends) return std::nullopt;
    if (open_.size() != 1) return Error{"an if or while has no end"};
    done_.push_back({name_, std::move(open_.back())});
    open_.clear();
    return std::nullopt;
  }

  Failure ofFlow(Reader& reader) {
    const bool choice = reader.take("if"), repeat = !choice && reader.take("while");
    if (choice || repeat) {
      auto condition = reader.value();
      if (!condition) return condition.error();
      add({.is = choice ? Statement::Is::choice : Statement::Is::repeat, .values = {std::move(*condition)}});
      open_.emplace_back();
      return std::nullopt;
    }
    if (reader.take("break")) return add({.is = Statement::Is::leave});
    if (open_.size() < 2) return Error{"nothing is open"};
    Statement& owner = open_[open_.size() - 2].back();
    owner.bodies.push_back(std::move(open_.back()));
    open_.pop_back();
    if (reader.take("endif") || reader.take("endwhile")) return std::nullopt;
    if (reader.take("elseif")) {
      auto condition = reader.value();
      if (!condition) return condition.error();
      owner.values.push_back(std::move(*condition));
    } else if (!reader.take("else")) {
      return Error{"unknown: " + std::string{reader.rest()}};
    }
    open_.emplace_back();
    return std::nullopt;
  }

  Failure add(Statement statement) {
    if (open_.empty()) return Error{"a block outside of a subprogram"};
    open_.back().push_back(std::move(statement));
    return std::nullopt;
  }

  std::string name_;
  std::string_view note_;
  std::vector<Statement> before_;  // comments above a subprogram
  std::vector<std::vector<Statement>> open_;
  std::vector<Subprogram> done_;
};

}  // namespace

Outcome<std::vector<Subprogram>> subprogramsOf(std::string_view source) {
  return Program{}.read(source);
}

}  // namespace probebox::gcode::loop
