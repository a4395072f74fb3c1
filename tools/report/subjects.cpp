#include "tools/report/subjects.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "firmware/metrology/solve.hpp"
#include "protocol/units/plain_input.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/solve_here.hpp"

namespace probebox::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using metrology::Estimate;
using metrology::Refusal;
using metrology::Result;

double number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

std::vector<double> numbers(const Json& list) {
  std::vector<double> values;
  for (const auto& item : list) values.push_back(number(item));
  return values;
}

// Numbers of whatever shape, row by row; none where the answer says null.
std::vector<double> flat(const Json& json) {
  if (json.is_null()) return {};
  if (!json.is_array()) return {number(json)};
  std::vector<double> values;
  for (const auto& item : json) {
    const auto part = item.is_array() ? numbers(item) : std::vector<double>{number(item)};
    values.insert(values.end(), part.begin(), part.end());
  }
  return values;
}

// Error for JSON that no solver has written.
struct NoAnswer {};

Estimate estimate(const std::string& key, const Json& json) {
  if (!json.is_array()) return Estimate::scalar(key, number(json), std::nullopt);
  const auto values = flat(json);
  if (values.empty()) throw NoAnswer{};
  if (!json.front().is_array()) return Estimate::vector(key, values, {});
  const auto columns = json.front().size();
  for (const auto& row : json) {
    if (!row.is_array() || row.size() != columns) throw NoAnswer{};
  }
  return Estimate::matrix(key, columns, values, {});
}

// A number for every value, or none at all.
void requireOneForEachValue(const Estimate& read) {
  for (const auto* of_each : {&read.sd, &read.design, &read.uncertainty}) {
    if (!of_each->empty() && of_each->size() != read.values.size()) throw NoAnswer{};
  }
}

std::vector<double> listUnder(const Json& line, const char* group, const std::string& key) {
  const auto found = line.find(group);
  if (found == line.end() || !found->is_object() || !found->contains(key)) return {};
  return flat(found->at(key));
}

void readEstimates(Result& result, const Json& line) {
  for (const auto& [key, value] : line.at("result").items()) {
    Estimate read = estimate(key, value);
    read.sd = listUnder(line, "sd", key);
    read.design = listUnder(line, "design", key);
    for (const double u : listUnder(line, "expanded_k2", key)) read.uncertainty.push_back(u / 2.0);
    requireOneForEachValue(read);
    result.estimates.push_back(std::move(read));
  }
  if (result.estimates.empty()) throw NoAnswer{};
  if (!line.contains("also")) return;
  for (const auto& [key, value] : line.at("also").items()) {
    result.also.push_back(estimate(key, value));
    result.also.back().sd = listUnder(line, "also_sd", key);
    requireOneForEachValue(result.also.back());
  }
}

void readBudget(Result& result, const Json& line) {
  for (const auto& item : line.at("budget")) {
    metrology::Contribution contribution{item.at("name").get<std::string>(), item.at("type") == "B", {}};
    for (const auto& known : result.estimates) {
      auto sd = listUnder(item, "sd", known.key);
      sd.resize(known.values.size(), 0.0);
      contribution.sd.insert(contribution.sd.end(), sd.begin(), sd.end());
    }
    result.budget.push_back(std::move(contribution));
  }
}

void readResiduals(Result& result, const Json& json) {
  result.residuals.unit = json.at("unit").get<std::string>();
  result.residuals.against = json.at("against").get<std::string>();
  result.residuals.names = json.at("names").get<std::vector<std::string>>();
  result.residuals.at = numbers(json.at("at"));
  result.residuals.values = numbers(json.at("values"));
  const std::size_t count = result.residuals.values.size();
  if (result.residuals.names.size() != count || result.residuals.at.size() != count) result.residuals = {};
}

Result resultOf(const Json& line) {
  Result result;
  result.method = line.at("method").get<std::string>();
  readEstimates(result, line);
  result.rms = number(line.at("rms"));
  result.dof = line.at("dof").get_ref<const Json::number_unsigned_t&>();
  result.condition = number(line.at("condition"));
  result.warnings = line.at("warnings").get<std::vector<std::string>>();
  if (line.contains("chi2_reduced")) result.chi2_reduced = number(line.at("chi2_reduced"));
  result.convention = line.value("convention", std::string{});
  result.design_per = line.value("design_per", std::string{});
  if (line.contains("unobservable")) result.unobservable = line.at("unobservable").get<std::vector<std::string>>();
  if (line.contains("weakest")) {
    const Json& weakest = line.at("weakest");
    result.weakest = {weakest.at("components").get<std::vector<std::string>>(), numbers(weakest.at("coefficients")),
                      number(weakest.at("sd"))};
    if (result.weakest->components.size() != result.weakest->coefficients.size()) throw NoAnswer{};
  }
  if (line.contains("dropped")) {
    for (const auto& item : line.at("dropped")) {
      result.dropped.push_back({item.at("name").get<std::string>(), item.at("reason").get<std::string>()});
    }
  }
  if (line.contains("budget")) readBudget(result, line);
  if (line.contains("residuals")) readResiduals(result, line.at("residuals"));
  if (line.contains("conditions")) {
    for (const auto& [key, value] : line.at("conditions").items()) {
      result.conditions.push_back({key, value.get<std::string>()});
    }
  }
  return result;
}

Refusal refusalOf(const Json& line) {
  const auto name = line.at("refusal").get<std::string>();
  auto reason = line.at("reason").get<std::string>();
  if (reason.starts_with(name + ": ")) reason.erase(0, name.size() + 2);
  return {name, reason};
}

Outcome<Subject> subjectOf(const Json& line, const std::string& where) {
  const Error no_answer{where + ": no answer of `probebox solve --json`; give that, or a case folder"};
  try {
    const auto status = line.at("status").get<std::string>();
    if (status == "unreadable") return Error{where + ": " + line.at("reason").get<std::string>()};
    Subject subject{line.at("case").get<std::string>(), line.at("method").get<std::string>(), {}, Refusal{}};
    if (status == "ok") {
      subject.answer = resultOf(line);
    } else {
      subject.answer = refusalOf(line);
    }
    return subject;
  } catch (const Json::exception&) {
    return no_answer;
  } catch (const NoAnswer&) {
    return no_answer;
  }
}

Outcome<Json> parsed(std::string_view text, const std::string& where) {
  try {
    return Json::parse(text);
  } catch (const Json::exception&) {
    return Error{where + ": not JSON; give the output of `probebox solve --json`, or a case folder"};
  }
}

void attachCase(Subject& subject) {
  std::error_code none;
  if (!fs::is_directory(subject.name, none)) return;
  auto dataset = casefolder::readCase(subject.name);
  if (dataset && dataset->method == subject.method) subject.dataset = std::move(dataset).value();
}

Outcome<std::vector<Subject>> ofCase(const fs::path& folder) {
  auto dataset = casefolder::readCase(folder);
  if (!dataset) {
    if (const auto* unreadable = std::get_if<casefolder::Unreadable>(&dataset.error()))
      return Error{unreadable->reason};
    const auto& unsupported = std::get<casefolder::Unsupported>(dataset.error());
    return std::vector{Subject{folder.string(), unsupported.method, {}, unsupported.refusal}};
  }
  auto solved = casefolder::solveHere(dataset.value());
  Subject subject{folder.string(), dataset->method, std::move(dataset).value(), Refusal{}};
  if (solved) {
    subject.answer = std::move(solved).value();
  } else {
    subject.answer = solved.error();
  }
  return std::vector{std::move(subject)};
}

// Rounding may differ between two processors.
bool alike(const Estimate& one, const Estimate& other) {
  if (one.key != other.key || one.values.size() != other.values.size()) return false;
  for (std::size_t k = 0; k < one.values.size(); ++k) {
    const double sd = k < one.sd.size() ? one.sd[k] : 0.0;
    const double close = 1e-6 * sd + 1e-12 * std::abs(one.values[k]);
    if (!(std::abs(one.values[k] - other.values[k]) <= close)) return false;
  }
  return true;
}

}  // namespace

bool recallResiduals(Subject& subject) {
  auto* kept = std::get_if<Result>(&subject.answer);
  if (kept == nullptr || !subject.dataset) return false;
  auto again = casefolder::solveHere(*subject.dataset);
  if (!again || !std::ranges::equal(kept->estimates, again->estimates, alike)) return false;
  kept->residuals = std::move(again->residuals);
  return true;
}

Outcome<std::vector<Subject>> subjectsOf(std::string_view text, const std::string& name) {
  std::vector<Subject> subjects;
  const auto add = [&](const Json& line, const std::string& where) -> std::optional<Error> {
    TRY(auto subject, subjectOf(line, where));
    attachCase(subject);
    subjects.push_back(std::move(subject));
    return std::nullopt;
  };
  if (const auto whole = parsed(text, name); whole && whole->is_object()) {
    if (auto error = add(whole.value(), name)) return *error;
    return subjects;
  }
  std::istringstream lines{std::string{text}};
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string where = name + ", line " + std::to_string(++count);
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    TRY(const auto json, parsed(line, where));
    if (auto error = add(json, where)) return *error;
  }
  if (subjects.empty()) return Error{name + ": empty; give the output of `probebox solve --json`, or a case folder"};
  return subjects;
}

Outcome<std::vector<Subject>> subjectsIn(const fs::path& path) {
  std::error_code none;
  if (fs::is_directory(path, none)) return ofCase(path);
  if (const auto why = whyNoPlainInput(path)) return Error{path.string() + ": cannot be read (" + *why + ")"};
  std::ifstream file{path, std::ios::binary};
  std::ostringstream text;
  if (file.peek() != std::ifstream::traits_type::eof()) text << file.rdbuf();  // of nothing it would fail
  if (!file.is_open() || file.bad() || !text)
    return Error{path.string() + ": there is no such case folder or file of answers"};
  return subjectsOf(text.str(), path.string());
}

}  // namespace probebox::report
