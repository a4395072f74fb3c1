#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <ranges>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::command {

// A JSON value to print, built from nested braces as nlohmann::ordered_json is. Nearly every command builds some, and
// including that library costs seconds of compile time per file, so json.cpp alone includes it.
class Json {
 public:
  Json();
  Json(std::nullptr_t);
  Json(const char* text);
  Json(std::string_view text);
  Json(const std::string& text);
  // {{"key", value}, ...} is an object; any other list is an array.
  Json(std::initializer_list<Json> items);
  template <std::same_as<bool> T>
  Json(T value) : kind_{Kind::boolean}, whole_{value ? 1U : 0U} {}
  template <std::unsigned_integral T>
  requires(!std::same_as<T, bool>) Json(T value) : kind_{Kind::count}, whole_{value} {}
  template <std::signed_integral T>
  Json(T value) : kind_{Kind::integer}, whole_{static_cast<std::uint64_t>(static_cast<std::int64_t>(value))} {}
  template <std::floating_point T>
  Json(T value) : kind_{Kind::real}, real_{value} {}
  template <std::ranges::input_range T>
  requires(!std::convertible_to<const T&, std::string_view>) Json(const T& values) : kind_{Kind::array} {
    for (const auto& value : values) push_back(value);
  }
  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  static Json array();
  static Json object();

  // Appends to an array; null becomes an array first.
  void push_back(Json item);
  // Returns the value of a key, null when it is new; null becomes an object first.
  Json& operator[](std::string_view key);
  // Adds the keys of another object; an existing key gets the other's value.
  void update(const Json& object);

  // Prints on one line. Bytes that are not UTF-8 are replaced. Numbers have the shortest digits that read back as the
  // same double; a number that is not finite becomes null.
  std::string dump() const;

 private:
  enum class Kind : std::uint8_t { null, boolean, count, integer, real, string, array, object };
  friend struct Printing;

  bool isMember() const;

  Kind kind_{Kind::null};
  std::uint64_t whole_{};
  double real_{};
  std::string text_;
  std::vector<std::string> keys_;  // of an object: one for each item
  std::vector<Json> items_;
};

}  // namespace probebox::command
