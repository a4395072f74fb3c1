#include "tools/case/method_text.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>
#include <vector>

#include "firmware/metrology/checks/checks.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/solve.hpp"
#include "protocol/units/nearest.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Method;
using metrology::MethodKey;

constexpr std::size_t kNameWidth = 28;

std::string padded(std::string_view name) {
  std::string text{name};
  text.resize(std::max(kNameWidth, text.size() + 1), ' ');
  return text;
}

// Those that every case has: what is said about the table tells of others.
std::vector<std::string_view> namesOf(const metrology::MethodTable& table) {
  std::vector<std::string_view> names;
  for (const auto& column : table.columns)
    if (column.may_be != metrology::MayBe::missing) names.push_back(column.name);
  return names;
}

std::string columnsOf(const metrology::MethodTable& table) {
  std::string text;
  for (const auto name : namesOf(table)) text += (text.empty() ? "" : ",") + std::string{name};
  return text;
}

std::string fallbackOf(const MethodKey& key) {
  if (key.fallback == metrology::kNeeded) return "needed";
  return key.fallback.empty() ? "" : "default " + std::string{key.fallback};
}

std::string quoted(std::string_view name) {
  return "`" + std::string{name} + "`";
}

std::string keyCell(const MethodKey& key) {
  const std::string fallback = fallbackOf(key);
  return quoted(key.name) + (fallback.empty() ? "" : " (" + fallback + ")");
}

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const auto& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

void describe(std::ostream& out, const Method& method) {
  out << method.name << ": " << method.title << "\n  equations " << method.equations
      << " of docs/metrology.md; source: " << method.source << "\ntables\n";
  for (const auto& table : method.tables) {
    out << "  " << padded(table.name) << columnsOf(table) << "\n  " << padded("") << table.about << "\n";
  }
  if (!method.keys.empty()) out << "config keys\n";
  for (const auto& key : method.keys) {
    const std::string fallback = fallbackOf(key);
    out << "  " << padded(key.name) << key.about << (fallback.empty() ? "" : " (" + fallback + ")") << "\n";
  }
  const auto type_b = metrology::typeBKeys(method);
  if (!type_b.empty()) out << "type B keys\n";
  for (const auto key : type_b) out << "  " << key << "\n";
  out << "results\n";
  for (const auto& result : method.results) out << "  " << padded(result.key) << result.about << "\n";
  if (!method.unobservable.empty()) out << "cannot observe\n";
  for (const auto sentence : method.unobservable) out << "  " << sentence << "\n";
}

nlohmann::ordered_json describedAsJson(const Method& method) {
  nlohmann::ordered_json json{{"method", method.name},
                              {"title", method.title},
                              {"equations", method.equations},
                              {"source", method.source},
                              {"tables", nlohmann::ordered_json::array()},
                              {"keys", nlohmann::ordered_json::array()},
                              {"type_b_keys", metrology::typeBKeys(method)},
                              {"results", nlohmann::ordered_json::array()},
                              {"unobservable", nlohmann::ordered_json::array()}};
  for (const auto& table : method.tables) {
    json["tables"].push_back({{"name", table.name}, {"columns", namesOf(table)}, {"about", table.about}});
  }
  for (const auto& key : method.keys) {
    nlohmann::ordered_json entry{{"name", key.name}, {"needed", key.fallback == metrology::kNeeded}};
    if (!key.fallback.empty() && key.fallback != metrology::kNeeded) entry["default"] = key.fallback;
    entry["about"] = key.about;
    json["keys"].push_back(std::move(entry));
  }
  for (const auto& result : method.results) json["results"].push_back({{"key", result.key}, {"about", result.about}});
  for (const auto sentence : method.unobservable) json["unobservable"].push_back(sentence);
  return json;
}

}  // namespace

int explainMethods(std::span<const std::string> names, bool json, std::ostream& out, std::ostream& err) {
  std::vector<const Method*> chosen;
  for (const auto& name : names) {
    chosen.push_back(metrology::methodNamed(name));
    if (chosen.back() != nullptr) continue;
    err << "probebox solve: there is no method '" << name << "'" << didYouMean(name, metrology::methods())
        << "; `probebox solve --methods` lists them\n";
    return 2;
  }
  const bool all = chosen.empty();
  if (all) chosen.assign(metrology::allMethods().begin(), metrology::allMethods().end());
  for (const Method* method : chosen) {
    if (json) {
      out << describedAsJson(*method).dump() << "\n";
    } else if (all) {
      out << padded(method->name) << method->title << "\n";
    } else {
      describe(out, *method);
    }
  }
  return 0;
}

std::string methodTables() {
  std::string text = "| method | tables | keys | result |\n|---|---|---|---|\n";
  for (const Method* method : metrology::allMethods()) {
    std::vector<std::string> tables, keys, results;
    for (const auto& table : method->tables) {
      tables.push_back(std::string{table.name} + " `" + columnsOf(table) + "` (" + std::string{table.about} + ")");
    }
    for (const auto& key : method->keys) keys.push_back(keyCell(key));
    for (const auto& result : method->results) results.push_back(quoted(result.key));
    text += "| " + quoted(method->name) + " | " + joined(tables, "; ") + " | " + joined(keys, ", ") + " | " +
            joined(results, ", ") + " |\n";
  }
  return text;
}

std::string tableOfChecks() {
  std::string text = "| check | of | what shows it |\n|---|---|---|\n";
  for (const auto& [name, applies, about, before, after] : metrology::checks())
    text += "| " + std::string{name} + " | " + std::string{applies} + " | " + std::string{about} + " |\n";
  return text;
}

std::string typeBTable() {
  std::string text = "| method | type B keys |\n|---|---|\n";
  for (const Method* method : metrology::allMethods()) {
    if (method->known.empty()) continue;
    std::vector<std::string> keys;
    for (const auto& known : method->known) {
      const bool in_table = known.kind == metrology::KnownKind::table;
      keys.push_back(quoted(known.sd_key) + " of " + (in_table ? "each coordinate of table " : "") + quoted(known.key) +
                     (known.in_sd ? " (in `sd` and `covariance` already)" : ""));
    }
    text += "| " + quoted(method->name) + " | " + joined(keys, ", ") + " |\n";
  }
  return text;
}

}  // namespace probebox::casefolder
