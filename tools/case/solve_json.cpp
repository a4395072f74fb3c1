#include "tools/case/solve_json.hpp"

#include <cmath>
#include <optional>

namespace probebox::casefolder {
namespace {

using Json = nlohmann::ordered_json;
using metrology::Estimate;
using metrology::Shape;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json shaped(const Estimate& estimate, const std::vector<double>& values) {
  if (estimate.shape == Shape::scalar) return number(values.front());
  Json list = Json::array();
  const std::size_t row = estimate.shape == Shape::matrix ? estimate.columns : values.size();
  if (estimate.shape == Shape::vector) {
    for (const double value : values) list.push_back(number(value));
    return list;
  }
  for (std::size_t from = 0; from + row <= values.size() && row > 0; from += row) {
    Json cells = Json::array();
    for (std::size_t k = from; k < from + row; ++k) cells.push_back(number(values[k]));
    list.push_back(std::move(cells));
  }
  return list;
}

Json spread(const Estimate& estimate, double factor) {
  if (estimate.sd.empty()) return nullptr;
  std::vector<double> scaled;
  for (const double sd : estimate.sd) scaled.push_back(factor * sd);
  return shaped(estimate, scaled);
}

bool anySd(const metrology::Result& result) {
  for (const auto& estimate : result.estimates) {
    if (!estimate.sd.empty()) return true;
  }
  return false;
}

Json covariance(const metrology::Covariance& given) {
  const std::size_t n = given.components.size();
  Json rows = Json::array();
  for (std::size_t i = 0; i < n; ++i) {
    Json row = Json::array();
    for (std::size_t k = 0; k < n; ++k) row.push_back(number(given.values[i * n + k]));
    rows.push_back(std::move(row));
  }
  return {{"components", given.components}, {"values", std::move(rows)}};
}

void addKnown(Json& line, const metrology::Result& result) {
  if (result.chi2_reduced) line["chi2_reduced"] = number(*result.chi2_reduced);
  if (anySd(result)) {
    for (const auto& estimate : result.estimates) line["expanded_k2"][estimate.key] = spread(estimate, 2.0);
  }
  if (result.covariance) line["covariance"] = covariance(*result.covariance);
  for (const auto& dropped : result.dropped) {
    line["dropped"].push_back({{"name", dropped.name}, {"reason", dropped.reason}});
  }
  if (!result.convention.empty()) line["convention"] = result.convention;
  for (const auto& estimate : result.also) line["also"][estimate.key] = shaped(estimate, estimate.values);
}

}  // namespace

Json toJson(const metrology::Result& result, std::string_view case_name) {
  Json line;
  line["schema_version"] = kSchemaVersion;
  line["method"] = result.method;
  line["case"] = case_name;
  line["status"] = "ok";
  line["result"] = Json::object();
  for (const auto& estimate : result.estimates) line["result"][estimate.key] = shaped(estimate, estimate.values);
  line["sd"] = nullptr;
  if (anySd(result)) {
    for (const auto& estimate : result.estimates) line["sd"][estimate.key] = spread(estimate, 1.0);
  }
  line["condition"] = number(result.condition);
  line["rms"] = number(result.rms);
  line["dof"] = result.dof;
  line["warnings"] = result.warnings;
  addKnown(line, result);
  return line;
}

Json toJson(const metrology::Refusal& refusal, std::string_view method, std::string_view case_name) {
  return {{"schema_version", kSchemaVersion},
          {"method", method},
          {"case", case_name},
          {"status", "refused"},
          {"refusal", refusal.name},
          {"reason", refusal.name + ": " + refusal.reason}};
}

Json toJson(const Unreadable& unreadable, std::string_view case_name) {
  return {
      {"schema_version", kSchemaVersion}, {"case", case_name}, {"status", "unreadable"}, {"reason", unreadable.reason}};
}

}  // namespace probebox::casefolder
