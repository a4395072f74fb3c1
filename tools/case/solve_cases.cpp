#include "tools/case/solve_cases.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/estimate.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "protocol/units/wording.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/proof.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/case/solve_here.hpp"
#include "tools/case/solve_json.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using metrology::Refusal;
using metrology::Result;

std::string printed(const char* format, double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

// Whether type B inputs are in u and U beside the sd.
bool hasTypeB(const Quantity& quantity) {
  return quantity.sd && quantity.expanded && *quantity.expanded != 2 * *quantity.sd;
}

void print(std::ostream& out, const Quantity& quantity) {
  std::string name = quantity.label.name;
  name.resize(std::max<std::size_t>(name.size(), 24), ' ');
  out << "  " << name << "  ";
  if (quantity.by_definition) {
    out << withSdAndU(quantity) << "\n";
    return;
  }
  out << withUncertainty(quantity.label, quantity.value, quantity.uncertainty());
  if (hasTypeB(quantity)) out << ", sd " << withUnit(quantity.label, *quantity.sd);
  if (quantity.expanded) out << "; U " << withUnit(quantity.label, *quantity.expanded);
  out << "\n";
}

// The letter of the rotary axis that a case is about.
std::string axisOf(const metrology::Dataset& dataset) {
  const auto axis = dataset.config.find("axis");
  const auto* letter = axis == dataset.config.end() ? nullptr : std::get_if<std::string>(&axis->second);
  return letter == nullptr ? std::string{} : *letter;
}

void print(std::ostream& out, const std::string& case_name, const Result& result, const std::string& axis) {
  out << case_name << ": " << result.method << "\n";
  if (const auto proof = metrology::proofOf(result))
    out << "  " << proofInWords(*proof, !result.warnings.empty()) << "\n";
  for (const auto& quantity : quantitiesOf(result, axis)) print(out, quantity);
  out << "  (+/- u, k = 1, with type B; sd of readings, k = 1; U, k = 2; rms "
      << ofAReading(result.rms, metrology::unitOfRms(result)) << ", " << result.dof
      << " degrees of freedom of the fit, condition " << printed("%.3g", result.condition);
  if (result.chi2_reduced) out << ", " << chiSquareText(result);
  out << ")\n";
  if (const auto figure = result.designFigure()) {
    out << "  design: sd of "
        << designText(metrology::partsOf(result.estimates.front()).front().key, *figure, result.design_per) << "\n";
  }
  for (const auto& [name, value] : result.conditions) {
    if (name == metrology::kAccuracyAssumed) out << "  " << name << ": " << value << "\n";
  }
  if (!result.convention.empty()) out << "  " << result.convention << "\n";
  for (const auto& dropped : result.dropped) out << "  dropped: " << dropped.name << ": " << dropped.reason << "\n";
  for (const auto& warning : result.warnings) out << "  warning: " << warning << "\n";
}

void printJson(std::ostream& out, const nlohmann::ordered_json& line) {
  out << line.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) << "\n";
}

}  // namespace

int solveCase(const fs::path& folder, bool json, std::ostream& out, std::ostream& err) {
  const std::string name = folder.string();
  const auto refuse = [&](const std::string& method, const Refusal& refusal) {
    if (json) {
      printJson(out, toJson(refusal, method, name));
    } else {
      out << shownLines(name + ": " + method + " refused\n  " + refusal.name + ": " + refusal.reason + "\n");
    }
    return 1;
  };
  const auto dataset = readCase(folder);
  if (!dataset) {
    if (const auto* unreadable = std::get_if<Unreadable>(&dataset.error())) {
      err << shownLines("probebox solve: " + unreadable->reason + "\n");
      if (json) printJson(out, toJson(*unreadable, name));
      return 2;
    }
    const auto& unsupported = std::get<Unsupported>(dataset.error());
    return refuse(unsupported.method, unsupported.refusal);
  }
  const auto solved = solveHere(dataset.value());
  if (!solved) return refuse(dataset->method, solved.error());
  if (json) {
    printJson(out, toJson(solved.value(), name));
  } else {
    std::ostringstream text;
    print(text, name, solved.value(), axisOf(dataset.value()));
    out << shownLines(text.str());
  }
  return 0;
}

}  // namespace probebox::casefolder
