#include "tools/case/solve_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "firmware/metrology/fit/noise_check.hpp"

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

Json spread(const Estimate& estimate, const std::vector<double>& sds, double factor) {
  if (sds.empty()) return nullptr;
  std::vector<double> scaled;
  for (const double sd : sds) scaled.push_back(factor * sd);
  return shaped(estimate, scaled);
}

// Without type B inputs the combined uncertainty is the sd.
const std::vector<double>& combined(const Estimate& estimate) {
  return estimate.uncertainty.empty() ? estimate.sd : estimate.uncertainty;
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

// One object a line of the budget, its sd with the keys and shapes of the result.
Json budget(const metrology::Result& result) {
  Json lines = Json::array();
  for (const auto& contribution : result.budget) {
    Json sd = Json::object();
    auto from = contribution.sd.begin();
    for (const auto& estimate : result.estimates) {
      const auto until = from + static_cast<std::ptrdiff_t>(estimate.values.size());
      const bool known = contribution.type_b || !estimate.sd.empty();
      sd[estimate.key] = known ? shaped(estimate, {from, until}) : Json(nullptr);
      from = until;
    }
    lines.push_back({{"name", contribution.name}, {"type", contribution.type_b ? "B" : "A"}, {"sd", std::move(sd)}});
  }
  return lines;
}

void addDesign(Json& line, const metrology::Result& result) {
  const auto figure = result.designFigure();
  if (!figure) return;
  for (const auto& estimate : result.estimates) {
    line["design"][estimate.key] = estimate.design.empty() ? Json(nullptr) : shaped(estimate, estimate.design);
  }
  line["design_figure"] = number(*figure);
  line["design_per"] = result.design_per;
}

Json residuals(const metrology::Residuals& given) {
  Json at = Json::array();
  Json values = Json::array();
  for (const double place : given.at) at.push_back(number(place));
  for (const double value : given.values) values.push_back(number(value));
  return {{"unit", given.unit},
          {"against", given.against},
          {"names", given.names},
          {"at", std::move(at)},
          {"values", std::move(values)}};
}

void addAbout(Json& line, const metrology::Result& result) {
  addDesign(line, result);
  if (!result.unobservable.empty()) line["unobservable"] = result.unobservable;
  if (result.weakest) {
    line["weakest"] = {{"components", result.weakest->components},
                       {"coefficients", result.weakest->coefficients},
                       {"sd", number(result.weakest->sd)}};
  }
  if (!result.budget.empty()) line["budget"] = budget(result);
  for (const auto& condition : result.conditions) line["conditions"][condition.name] = condition.value;
  if (!result.residuals.values.empty()) line["residuals"] = residuals(result.residuals);
}

void addChiSquare(Json& line, const metrology::Result& result) {
  line["chi2_reduced"] = number(*result.chi2_reduced);
  const auto law = metrology::lawOf(result);
  if (!law) return;
  const auto [low, high] = metrology::expectedRange(*law);
  line["chi2_dof"] = law->dof;
  line["chi2_range"] = {number(low), number(high)};
}

void addKnown(Json& line, const metrology::Result& result) {
  if (result.chi2_reduced) addChiSquare(line, result);
  if (anySd(result)) {
    for (const auto& estimate : result.estimates)
      line["expanded_k2"][estimate.key] = spread(estimate, combined(estimate), 2.0);
  }
  if (result.covariance) line["covariance"] = covariance(*result.covariance);
  for (const auto& dropped : result.dropped) {
    line["dropped"].push_back({{"name", dropped.name}, {"reason", dropped.reason}});
  }
  if (!result.convention.empty()) line["convention"] = result.convention;
  for (const auto& estimate : result.also) {
    line["also"][estimate.key] = shaped(estimate, estimate.values);
    if (!estimate.sd.empty()) line["also_sd"][estimate.key] = spread(estimate, estimate.sd, 1.0);
  }
  addAbout(line, result);
}

}  // namespace

namespace {

// Adds the records that go back to the tool store: one for motion control, one for simulation (docs/metrology.md (C4)).
void addToolStore(Json& line, const metrology::Result& result) {
  const auto* motion = result.find("motion_control_mm");
  const auto* simulation = result.find("simulation_mm");
  if (!motion || !simulation) return;
  const auto record = [](const Estimate& estimate, const char* x, const char* y, const char* z) {
    Json json{{x, number(estimate.values[0])}, {y, number(estimate.values[1])}, {z, number(estimate.values[2])}};
    json["sd_mm"] = spread(estimate, estimate.sd, 1.0);
    return json;
  };
  Json& store = line["tool_store"];
  for (const char* key : {"tool_id", "holder_id", "measured_at_s"}) store[key] = number(result.find(key)->value());
  store["motion_control"] = record(*motion, "W2_x_mm", "W2_y_mm", "L4_mm");
  store["simulation"] = record(*simulation, "W1_x_mm", "W1_y_mm", "L3_mm");
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
    for (const auto& estimate : result.estimates) line["sd"][estimate.key] = spread(estimate, estimate.sd, 1.0);
  }
  line["condition"] = number(result.condition);
  line["rms"] = number(result.rms);
  line["dof"] = result.dof;
  line["warnings"] = result.warnings;
  addKnown(line, result);
  addToolStore(line, result);
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
