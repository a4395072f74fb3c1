#include "firmware/store/dataset_json.hpp"

#include <nlohmann/json.hpp>

namespace probebox::store {
namespace {

using Json = nlohmann::ordered_json;

Json render(const metrology::Table& table) {
  Json columns = Json::array();
  for (const auto& column : table.columns) columns.push_back({{"name", column.name}, {"values", column.values}});
  return {{"name", table.name}, {"columns", std::move(columns)}};
}

}  // namespace

std::string toJson(const metrology::Dataset& dataset) {
  Json config = Json::object();
  for (const auto& [key, value] : dataset.config) {
    std::visit([&config, &key = key](const auto& content) { config[key] = content; }, value);
  }
  Json tables = Json::array();
  for (const auto& table : dataset.tables) tables.push_back(render(table));
  const Json json{{"method", dataset.method}, {"config", std::move(config)}, {"tables", std::move(tables)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace probebox::store
