#pragma once
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace probebox {

// A message for a person, in one sentence: what failed, where, and the remedy.
struct Error {
  std::string what;
};

// Holds a value or the error that prevented it.
template <class T, class E = Error>
class [[nodiscard]] Outcome {
 public:
  Outcome(T value) : content_{std::in_place_index<0>, std::move(value)} {}
  Outcome(E error) : content_{std::in_place_index<1>, std::move(error)} {}

  bool ok() const { return content_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return std::get<0>(content_); }
  const T& value() const& { return std::get<0>(content_); }
  T&& value() && { return std::get<0>(std::move(content_)); }
  const E& error() const& { return std::get<1>(content_); }
  E&& error() && { return std::get<1>(std::move(content_)); }

  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, E> content_;
};

// The outcome of an action without a value: `return {};` means success.
template <class E>
class [[nodiscard]] Outcome<void, E> {
 public:
  Outcome() = default;
  Outcome(E error) : error_{std::move(error)} {}

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }

  const E& error() const& { return *error_; }
  E&& error() && { return *std::move(error_); }

 private:
  std::optional<E> error_;
};

}  // namespace probebox

// Returns the error of an outcome to the caller, or continues with its value:
//   TRY(const auto address, parseAddress(text));  declares `address`, the value
//   TRY(connect(address));                        where there is no value, or none is needed
// An expression with a comma outside of brackets, as in `A{b, c}.d()`, needs parentheses around it.
#define TRY(first, ...) PROBEBOX_TRY##__VA_OPT__(_VALUE)(first __VA_OPT__(, ) __VA_ARGS__)

#define PROBEBOX_TRY(expression)                                            \
  do {                                                                      \
    if (auto tried = (expression); !tried) return std::move(tried).error(); \
  } while (false)

#define PROBEBOX_TRY_VALUE(declaration, ...) PROBEBOX_TRY_NAMED(PROBEBOX_TRIED(__LINE__), declaration, __VA_ARGS__)
#define PROBEBOX_TRY_NAMED(tried, declaration, ...) \
  auto tried = __VA_ARGS__;                         \
  if (!tried) return std::move(tried).error();      \
  declaration = std::move(tried).value()

#define PROBEBOX_TRIED(line) PROBEBOX_TRIED_AT(line)
#define PROBEBOX_TRIED_AT(line) tried_at_##line
