#pragma once
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
  const E& error() const { return std::get<1>(content_); }

  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, E> content_;
};

}  // namespace probebox
