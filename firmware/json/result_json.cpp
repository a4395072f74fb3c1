#include "firmware/json/result_json.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "firmware/json/numbers.hpp"
#include "firmware/metrology/uncertainty/worst_determined.hpp"

namespace probebox::json {
namespace {

using Json = nlohmann::ordered_json;

// Reads a list; empty for a result stored by a version without such lists.
std::vector<double> listed(const Json& item, const char* key) {
  return item.contains(key) ? numbers(item.at(key)) : std::vector<double>{};
}

Json render(const std::vector<metrology::Estimate>& estimates) {
  Json list = Json::array();
  for (const auto& e : estimates) {
    list.push_back({{"key", e.key},
                    {"shape", static_cast<int>(e.shape)},
                    {"columns", e.columns},
                    {"values", e.values},
                    {"sd", e.sd},
                    {"design", e.design},
                    {"uncertainty", e.uncertainty}});
  }
  return list;
}

// What reads a result relies on these sizes, and a result may come from another computer.
bool isWhole(const metrology::Estimate& estimate) {
  const auto count = estimate.values.size();
  const auto none_or_all = [count](const std::vector<double>& list) { return list.empty() || list.size() == count; };
  const bool shaped =
      estimate.shape == metrology::Shape::scalar ? count == 1 : estimate.columns > 0 && count % estimate.columns == 0;
  return shaped && none_or_all(estimate.sd) && none_or_all(estimate.design) && none_or_all(estimate.uncertainty);
}

std::vector<metrology::Estimate> estimates(const Json& list) {
  std::vector<metrology::Estimate> all;
  for (const auto& item : list) {
    const int shape = item.at("shape").get<int>();
    if (shape < 0 || shape > static_cast<int>(metrology::Shape::matrix))
      throw Json::other_error::create(0, "shape", &item);
    all.push_back({.key = item.at("key").get<std::string>(),
                   .shape = static_cast<metrology::Shape>(shape),
                   .values = numbers(item.at("values")),
                   .sd = numbers(item.at("sd")),
                   .columns = count(item.at("columns")),
                   .design = listed(item, "design"),
                   .uncertainty = listed(item, "uncertainty")});
    if (!isWhole(all.back()))
      throw Json::other_error::create(0, "the lists of " + all.back().key + " do not go together", &item);
  }
  return all;
}

// Budget and conditions of a result. Residuals are omitted: they follow from the dataset that is stored beside it.
Json renderGrounds(const metrology::Result& result) {
  Json budget = Json::array();
  for (const auto& line : result.budget) {
    budget.push_back({{"name", line.name}, {"type_b", line.type_b}, {"sd", line.sd}});
  }
  Json conditions = Json::array();
  for (const auto& condition : result.conditions) conditions.push_back({condition.name, condition.value});
  return {{"design_per", result.design_per},
          {"unobservable", result.unobservable},
          {"budget", std::move(budget)},
          {"conditions", std::move(conditions)}};
}

void readGrounds(const Json& json, metrology::Result& result) {
  result.design_per = json.at("design_per").get<std::string>();
  result.unobservable = json.at("unobservable").get<std::vector<std::string>>();
  for (const auto& line : json.at("budget")) {
    result.budget.push_back(
        {line.at("name").get<std::string>(), line.at("type_b").get<bool>(), numbers(line.at("sd"))});
  }
  for (const auto& condition : json.at("conditions")) {
    result.conditions.push_back({condition.at(0).get<std::string>(), condition.at(1).get<std::string>()});
  }
}

metrology::Covariance covarianceOf(const Json& json) {
  metrology::Covariance all{json.at("components").get<std::vector<std::string>>(), numbers(json.at("values"))};
  if (all.values.size() != all.components.size() * all.components.size())
    throw Json::other_error::create(0, "the covariance is not square", &json);
  return all;
}

metrology::Result result(const Json& json) {
  metrology::Result all;
  all.method = json.at("method").get<std::string>();
  all.estimates = estimates(json.at("estimates"));
  if (all.estimates.empty()) throw Json::other_error::create(0, "there is no estimate", &json);
  all.also = estimates(json.at("also"));
  all.rms = number(json.at("rms"));
  all.dof = count(json.at("dof"));
  all.condition = number(json.at("condition"));
  if (json.contains("chi2_reduced")) all.chi2_reduced = number(json.at("chi2_reduced"));
  if (json.contains("covariance")) {
    all.covariance = covarianceOf(json.at("covariance"));
    all.weakest = metrology::worstDeterminedOf(*all.covariance);
  }
  all.convention = json.value("convention", std::string{});
  all.warnings = json.at("warnings").get<std::vector<std::string>>();
  for (const auto& item : json.at("dropped")) {
    all.dropped.push_back({item.at("name").get<std::string>(), item.at("reason").get<std::string>()});
  }
  if (json.contains("grounds")) readGrounds(json.at("grounds"), all);
  return all;
}

// The JSON library reports by exceptions; they end here.
template <class Read>
auto guarded(std::string_view text, Read read) -> Outcome<decltype(read(Json{}))> {
  try {
    return read(Json::parse(text));
  } catch (const Json::exception& e) {
    return Error{std::string{"a stored result cannot be read: "} + e.what()};
  }
}

// A reason may quote bytes from a file that are not UTF-8.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string toJson(const metrology::Result& result) {
  Json json{{"method", result.method},     {"estimates", render(result.estimates)},
            {"also", render(result.also)}, {"rms", result.rms},
            {"dof", result.dof},           {"condition", result.condition}};
  if (result.chi2_reduced) json["chi2_reduced"] = *result.chi2_reduced;
  if (result.covariance) {
    json["covariance"] = {{"components", result.covariance->components}, {"values", result.covariance->values}};
  }
  json["convention"] = result.convention;
  json["warnings"] = result.warnings;
  json["dropped"] = Json::array();
  for (const auto& d : result.dropped) json["dropped"].push_back({{"name", d.name}, {"reason", d.reason}});
  json["grounds"] = renderGrounds(result);
  return dump(json);
}

Outcome<metrology::Result> resultFromJson(std::string_view text) {
  return guarded(text, result);
}

std::string toJson(const metrology::Refusal& refusal) {
  return dump({{"name", refusal.name}, {"reason", refusal.reason}});
}

Outcome<metrology::Refusal> refusalFromJson(std::string_view text) {
  return guarded(text, [](const Json& json) {
    return metrology::Refusal{json.at("name").get<std::string>(), json.at("reason").get<std::string>()};
  });
}

}  // namespace probebox::json
