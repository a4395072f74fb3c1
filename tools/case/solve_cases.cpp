#include "tools/case/solve_cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <ostream>
#include <string>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/solve_json.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using metrology::Estimate;
using metrology::Refusal;
using metrology::Result;

std::string printed(const char* format, double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

// Value and sd to the two digits of the sd that mean something.
std::string withSd(double value, std::optional<double> sd) {
  if (!sd || !(*sd > 0.0)) return printed("%.9g", value);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(*sd))), 0, 12);
  const std::string format = "%." + std::to_string(decimals) + "f";
  return printed(format.c_str(), value) + " +- " + printed(format.c_str(), *sd);
}

struct Label {
  std::string name;
  std::string unit;
  double factor{1.0};
};

// Times in seconds are read in milliseconds; other units are as the key names them.
Label labelOf(const std::string& key) {
  const auto ends = [&](std::string_view suffix) { return key.ends_with(suffix); };
  const auto without = [&](std::string_view suffix) { return key.substr(0, key.size() - suffix.size()); };
  if (ends("_mm_s")) return {without("_mm_s"), "mm/s", 1.0};
  if (ends("_um_s")) return {without("_um_s"), "um/s", 1.0};
  if (ends("_mm")) return {without("_mm"), "mm", 1.0};
  if (ends("_um")) return {without("_um"), "um", 1.0};
  if (ends("_rad")) return {without("_rad"), "rad", 1.0};
  if (ends("_s")) return {without("_s"), "ms", 1e3};
  return {key, "", 1.0};
}

void print(std::ostream& out, const Estimate& estimate) {
  const Label label = labelOf(estimate.key);
  for (std::size_t k = 0; k < estimate.values.size(); ++k) {
    std::string name = label.name;
    if (estimate.shape == metrology::Shape::vector) name += "[" + std::to_string(k) + "]";
    if (estimate.shape == metrology::Shape::matrix) {
      name += "[" + std::to_string(k / estimate.columns) + "][" + std::to_string(k % estimate.columns) + "]";
    }
    std::optional<double> sd;
    if (!estimate.sd.empty()) sd = label.factor * estimate.sd[k];
    name.resize(std::max<std::size_t>(name.size(), 24), ' ');
    out << "  " << name << "  " << withSd(label.factor * estimate.values[k], sd) << " " << label.unit << "\n";
  }
}

void print(std::ostream& out, const std::string& case_name, const Result& result) {
  out << case_name << ": " << result.method << "\n";
  for (const auto& estimate : result.estimates) print(out, estimate);
  out << "  (sd, k = 1; rms " << printed("%.3g", result.rms) << ", " << result.dof << " degrees of freedom, condition "
      << printed("%.3g", result.condition);
  if (result.chi2_reduced) out << ", reduced chi-square " << printed("%.3g", *result.chi2_reduced);
  out << ")\n";
  if (!result.convention.empty()) out << "  " << result.convention << "\n";
  for (const auto& warning : result.warnings) out << "  warning: " << warning << "\n";
}

// Answers one case; its exit status.
int solveCase(const fs::path& folder, bool json, std::ostream& out, std::ostream& err) {
  const std::string name = folder.string();
  const auto refuse = [&](const std::string& method, const Refusal& refusal) {
    if (json) {
      out << toJson(refusal, method, name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
    } else {
      out << name << ": " << method << " refused\n  " << refusal.name << ": " << refusal.reason << "\n";
    }
    return 1;
  };
  const auto dataset = readCase(folder);
  if (!dataset) {
    if (const auto* unreadable = std::get_if<Unreadable>(&dataset.error())) {
      err << "probebox solve: " << unreadable->reason << "\n";
      return 2;
    }
    const auto& unsupported = std::get<Unsupported>(dataset.error());
    return refuse(unsupported.method, unsupported.refusal);
  }
  const auto solved = metrology::solve(dataset.value());
  if (!solved) return refuse(dataset->method, solved.error());
  if (json) {
    out << toJson(solved.value(), name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  } else {
    print(out, name, solved.value());
  }
  return 0;
}

}  // namespace

int solveCases(std::span<const fs::path> folders, bool json, std::ostream& out, std::ostream& err) {
  if (folders.empty()) {
    err << "probebox solve: no case given; name at least one folder that holds a config.json\n";
    return 2;
  }
  int status = 0;
  for (const auto& folder : folders) {
    status = std::max(status, solveCase(folder, json, out, err));
    out.flush();  // one answer after the other, also into a pipe
  }
  return status;
}

}  // namespace probebox::casefolder
