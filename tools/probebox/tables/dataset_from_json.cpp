#include "tools/probebox/tables/dataset_from_json.hpp"

#include <limits>
#include <nlohmann/json.hpp>

namespace probebox::command {
namespace {

using Json = nlohmann::ordered_json;

double number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

std::vector<double> numbers(const Json& json) {
  std::vector<double> values;
  values.reserve(json.size());
  for (const auto& item : json) values.push_back(number(item));
  return values;
}

metrology::Value value(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_string()) return json.get<std::string>();
  if (!json.is_array()) return number(json);
  if (json.empty() || !json.front().is_array()) return numbers(json);
  metrology::Matrix rows;
  for (const auto& row : json) rows.push_back(numbers(row));
  return rows;
}

metrology::Table table(const Json& json) {
  metrology::Table all{.name = json.at("name").get<std::string>(), .columns = {}};
  for (const auto& column : json.at("columns")) {
    all.columns.push_back({column.at("name").get<std::string>(), numbers(column.at("values"))});
  }
  return all;
}

metrology::Dataset dataset(const Json& json) {
  metrology::Dataset all;
  all.method = json.at("method").get<std::string>();
  for (const auto& [key, content] : json.at("config").items()) all.config.emplace(key, value(content));
  for (const auto& item : json.at("tables")) all.tables.push_back(table(item));
  return all;
}

}  // namespace

Outcome<metrology::Dataset> datasetFromJson(std::string_view text) {
  try {
    return dataset(Json::parse(text));
  } catch (const Json::exception& e) {
    return Error{std::string{"the measured data from the box cannot be read ("} + e.what() +
                 "); update the older of the two"};
  }
}

}  // namespace probebox::command
