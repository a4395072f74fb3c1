#pragma once
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/probebox/cli/console.hpp"

namespace probebox::view {

// Reads a request of the page, a JSON object. A value of the wrong type is refused, naming its key: a default in its
// place would start a run that was not requested.
class PageRequest {
 public:
  // Braces around a json would make an array of it.
  explicit PageRequest(const std::string& text) : object_(nlohmann::json::parse(text, nullptr, false)) {
    if (!object_.is_object()) objection_ = "a request has to be a JSON object";
  }

  // 0 where it is absent.
  double number(const char* key) { return value(key) == nullptr ? 0 : numberOf(*value(key), key); }
  std::vector<double> numbers(const char* key) {
    std::vector<double> all;
    const auto* found = value(key);
    if (found == nullptr) return all;
    if (!found->is_array()) refuse(key, "a list of numbers");
    for (const auto& one : *found) all.push_back(numberOf(one, key));
    return all;
  }
  template <class T>
  T count(const char* key) {
    const double given = number(key);
    const bool good =
        given >= 0 && given < std::ldexp(1.0, std::numeric_limits<T>::digits) && given == std::floor(given);
    if (!good) refuse(key, "a whole number, such as 3");
    return good ? static_cast<T>(given) : T{};
  }
  std::string text(const char* key) {
    const auto* found = value(key);
    if (found != nullptr && !found->is_string()) refuse(key, "a text");
    return found != nullptr && found->is_string() ? found->get<std::string>() : std::string{};
  }
  bool flag(const char* key) {
    const auto* found = value(key);
    if (found != nullptr && !found->is_boolean()) refuse(key, "true or false");
    return found != nullptr && found->is_boolean() && found->get<bool>();
  }
  std::uint8_t axis() {
    const auto letter = text("axis");
    if (letter.empty()) return 0;
    const auto found = letter.size() == 1 ? std::string_view{"XYZABC"}.find(letter.front()) : std::string_view::npos;
    if (found == std::string_view::npos) refuse("axis", "a letter of X Y Z A B C");
    return found == std::string_view::npos ? std::uint8_t{0} : static_cast<std::uint8_t>(found + 1);
  }
  std::optional<command::Trouble> trouble() const {
    if (!objection_) return std::nullopt;
    return command::Trouble{command::ExitStatus::usage, "refused", *objection_};
  }

 private:
  const nlohmann::json* value(const char* key) const {
    if (!object_.is_object()) return nullptr;
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }
  double numberOf(const nlohmann::json& value, const char* key) {
    if (value.is_number()) return value.get<double>();
    refuse(key, "a number, such as 12.5");
    return 0;
  }
  void refuse(const char* key, const char* wanted) {
    if (!objection_) objection_ = std::string{key} + " has to be " + wanted;
  }

  nlohmann::json object_;
  std::optional<std::string> objection_;
};

}  // namespace probebox::view
