#pragma once
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

namespace probebox::json {

// JSON knows no NaN: it is written as null.
inline double number(const nlohmann::ordered_json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

// Whole and not negative; throws what nlohmann's readers throw.
inline std::size_t count(const nlohmann::ordered_json& json) {
  return json.get_ref<const nlohmann::ordered_json::number_unsigned_t&>();
}

inline std::vector<double> numbers(const nlohmann::ordered_json& json) {
  std::vector<double> values;
  values.reserve(json.size());
  for (const auto& item : json) values.push_back(number(item));
  return values;
}

}  // namespace probebox::json
