#include "firmware/metrology/checks/unusual.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/checks/residue.hpp"
#include "firmware/metrology/checks/suspects.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/noise_check.hpp"

namespace probebox::metrology {
namespace {

std::optional<std::string> unusual(const std::string& what, double size_mm, const UsualSize& usual) {
  if (size_mm >= usual.least_mm && size_mm <= usual.most_mm) return std::nullopt;
  const bool small = size_mm < usual.least_mm;
  return std::string{kUnusualLength} + ": " + what + " " + text(std::round(size_mm * 1000) / 1000) + " mm, " +
         (small ? "less than " + text(usual.least_mm) : "more than " + text(usual.most_mm)) +
         " mm, as seldom on a machine tool: are the lengths of this case in " +
         (small ? "inches? They are taken for mm" : "micrometres? They are taken for mm");
}

// Longest way of the readings along a machine axis.
double wayOf_mm(const Dataset& dataset, const Method& method, const Result& result) {
  const Residue residue{dataset, &method, result.residuals, result.dof};
  double way_mm = 0;
  for (const auto& table : readingTablesOf(residue)) {
    for (const auto& column : dataset.table(table)->columns) {
      if (!residue.isCoordinate(table, column.name)) continue;
      const auto [least, most] = std::ranges::minmax(column.values);
      way_mm = std::max(way_mm, most - least);
    }
  }
  return way_mm;
}

std::optional<std::string> unusualLength(const Dataset& dataset, const Method& method, const Result& result,
                                         const Estimate& estimate) {
  const auto* quantity = quantityOf(method, estimate.key);
  if (quantity == nullptr || quantity->usual.most_mm == 0 || estimate.values.empty()) return std::nullopt;
  const auto& usual = quantity->usual;
  if (usual.of_readings)
    return unusual("the places that were read are apart by", wayOf_mm(dataset, method, result), usual);
  const auto size = [](double value) { return std::abs(value); };
  return unusual(estimate.key + " is up to", size(std::ranges::max(estimate.values, {}, size)), usual);
}

}  // namespace

std::optional<Refusal> warnOfNoRedundancy(const Dataset&, const Method&, Result& result) {
  if (result.dof == 0 && !result.residuals.values.empty()) {
    result.warnings.push_back(std::string{kNoRedundancy} +
                              ": there are as many readings as unknowns, so that none checks another: a slip in one "
                              "of them is in the answer and in no sd; read once more than needed");
  }
  return std::nullopt;
}

std::optional<Refusal> warnOfUnusualScatter(const Dataset& dataset, const Method&, Result& result) {
  constexpr double kUsual_mm = 0.02;  // a worn machine and a rough ball scatter less
  const auto& values = result.residuals.values;
  if (dataset.config.contains(key::kSigma.name) || result.residuals.unit != "mm" || result.dof == 0)
    return std::nullopt;
  // rms is of all residuals that were not dropped, of which `values` may be some.
  const auto count = static_cast<double>(std::max(values.size(), result.dof));
  const double sd_mm = result.rms * std::sqrt(count / static_cast<double>(result.dof));
  if (!(sd_mm > kUsual_mm)) return std::nullopt;
  const auto farthest = std::ranges::max_element(values, {}, [](double value) { return std::abs(value); });
  result.warnings.push_back(std::string{kUnusualScatter} + ": the readings scatter by " +
                            text(std::round(sd_mm * 1e3) / 1e3) + " mm (k = 1) about the answer, more than " +
                            text(kUsual_mm) + " mm, as seldom on a machine tool; the farthest is " +
                            result.residuals.names[static_cast<std::size_t>(farthest - values.begin())] +
                            ": look for a mistyped digit, a slip, a loose part, or X in diameters");
  return std::nullopt;
}

std::optional<Refusal> warnOfInches(const Dataset&, const Method&, Result& result) {
  constexpr double kLeast = 0.002, kMost = 1.0 / 12, kMostChance = 0.004;  // exact numbers scatter less
  const auto law = lawOf(result);
  if (!law || law->noise_dof > 0 || result.residuals.unit != "mm") return std::nullopt;
  const double share = std::sqrt(*result.chi2_reduced);
  if (share < kLeast || share > kMost || law->probabilityBelow(*result.chi2_reduced) > kMostChance) return std::nullopt;
  result.warnings.push_back(std::string{kLengthsInInches} + ": the readings scatter by " +
                            text(std::round(1e3 * share) / 10) +
                            " % of their stated sigma; 4 % is left where coordinates are in inches and sigma is in mm: "
                            "are they? They are taken for mm");
  return std::nullopt;
}

std::optional<Refusal> warnOfUnusualLengths(const Dataset& dataset, const Method& method, Result& result) {
  for (const auto& estimate : result.estimates) {
    if (auto sentence = unusualLength(dataset, method, result, estimate))
      result.warnings.push_back(*std::move(sentence));
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
