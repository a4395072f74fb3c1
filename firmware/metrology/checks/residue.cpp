#include "firmware/metrology/checks/residue.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/chi_square.hpp"

namespace probebox::metrology {
namespace {

using Eigen::VectorXd;

constexpr std::size_t kMostResiduals = 600;  // more are thinned, and a fit of so many takes long
constexpr double kLeastNoise_mm = 1e-5;

// "x_mm" of "readings 3, x_mm"; empty of a point.
std::string_view partOf(std::string_view name) {
  const auto comma = name.rfind(", ");
  return comma == std::string_view::npos ? std::string_view{} : name.substr(comma + 2);
}

// Residuals of one coordinate.
using ByPart = std::map<std::string_view, std::vector<double>>;

ByPart byPart(const Residue& residue) {
  ByPart parts;
  for (std::size_t k = 0; k < residue.residuals.names.size(); ++k)
    parts[partOf(residue.residuals.names[k])].push_back(residue.residuals.values[k]);
  return parts;
}

}  // namespace

std::optional<ReadingRow> readingRowOf(const Dataset& dataset, std::string_view name) {
  name = name.substr(0, name.find(','));
  const auto space = name.rfind(' ');
  if (space == std::string_view::npos) return std::nullopt;
  std::size_t number = 0;
  const auto digits = name.substr(space + 1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || number == 0) return std::nullopt;
  for (const auto& suffix : {"", "s"}) {
    const std::string table = std::string{name.substr(0, space)} + suffix;
    const Table* found = dataset.table(table);
    if (found != nullptr && number <= found->rows()) return ReadingRow{table, number - 1};
  }
  return std::nullopt;
}

std::optional<Residue> residueOf(const Dataset& dataset, const Method& method) {
  auto solved = isWarm(dataset) ? method.solver(atTemperature(dataset, method)) : method.solver(dataset);
  if (!solved || solved->dof == 0 || solved->residuals.unit != "mm") return std::nullopt;
  const auto size = solved->residuals.values.size();
  if (size < solved->dof || size > kMostResiduals || solved->residuals.names.size() != size) return std::nullopt;
  const double rms = solved->rms;
  Residue residue{dataset, &method, std::move(solved->residuals), solved->dof};
  const double told = std::sqrt(residue.squares() / static_cast<double>(size));
  return std::abs(told - rms) <= 0.01 * rms + kLeastNoise_mm / 10 ? std::optional{std::move(residue)} : std::nullopt;
}

std::vector<double>* columnValues(Dataset& dataset, std::string_view table, std::string_view column) {
  const auto found = std::ranges::find(dataset.tables, table, &Table::name);
  if (found == dataset.tables.end()) return nullptr;
  const auto values = std::ranges::find(found->columns, column, &Column::name);
  return values == found->columns.end() ? nullptr : &values->values;
}

std::set<std::string> readingTablesOf(const Residue& residue) {
  std::set<std::string> tables;
  for (const auto& described : residue.method->tables) {
    const Table* table = described.readings ? residue.dataset.table(described.name) : nullptr;
    if (table != nullptr && table->column(column::kReadAt) != nullptr) tables.insert(table->name);
  }
  for (const auto& name : residue.residuals.names) {
    if (const auto row = readingRowOf(residue.dataset, name)) tables.insert(row->table);
  }
  return tables;
}

double leastVarianceOf(const Residue& residue) {
  const auto parts = byPart(residue);
  const bool has_parts =
      std::ranges::any_of(parts, [&](const auto& part) { return residue.isCoordinate({}, part.first); });
  double digit_mm = 0;
  for (const auto& table : residue.dataset.tables) {
    for (const auto& column : table.columns) {
      if (!residue.isCoordinate(table.name, column.name) || (has_parts && !parts.contains(column.name))) continue;
      const auto shown = shownDigit(column.values, 1);
      if (!shown.constant) digit_mm = std::max(digit_mm, shown.digit);
    }
  }
  const auto sigma = configPositive(residue.dataset, key::kSigma.name);
  const double half_mm = sigma && *sigma ? **sigma / 2 : 0;
  return std::max({kLeastNoise_mm * kLeastNoise_mm, digit_mm * digit_mm / 12, half_mm * half_mm});
}

Comparison compareHypotheses(const Residue& before, const Residue& after, std::size_t unknowns, double least_variance) {
  if (unknowns == 0 || before.dof <= unknowns) return {};
  const auto was = byPart(before), is = byPart(after);
  const auto dof = static_cast<double>(before.dof - unknowns);
  const auto squaresOf = [](const std::vector<double>& values) {
    return VectorXd::Map(values.data(), std::ssize(values)).squaredNorm();
  };
  double less = 0;
  std::size_t parts = 0;
  for (const auto& [part, values] : was) {
    const auto left = is.find(part);
    const double squares = left == is.end() ? 0 : squaresOf(left->second);
    const double share = static_cast<double>(values.size()) / static_cast<double>(before.residuals.values.size());
    less += (squaresOf(values) - squares) / std::max(squares / (share * dof), least_variance);
    parts += 1;
  }
  if (!(less > 0)) return {};
  const ChiSquareLaw law{unknowns, std::max<std::size_t>(1, (before.dof - unknowns) / parts)};
  return {law.probabilityAbove(less / static_cast<double>(unknowns)), dof * std::log1p(less / dof)};
}

std::optional<double> noiseOf(const Dataset& dataset) {
  for (const auto stops : {key::kSigmaC.name, key::kSigmaAngle.name}) {
    const auto sigma = configNumber(dataset, stops);
    if (sigma && *sigma && **sigma > 0) return std::nullopt;
  }
  const auto sigma = configPositive(dataset, key::kSigma.name);
  return sigma ? *sigma : std::nullopt;
}

Comparison compareByStatedNoise(const Residue& before, const Residue& after, std::size_t unknowns,
                                double least_variance) {
  constexpr double kAgrees = 1e-3, kGross = 100;
  auto found = compareHypotheses(before, after, unknowns, least_variance);
  const auto sigma_mm = noiseOf(after.dataset);
  if (!sigma_mm || after.dof == 0 || unknowns == 0) return found;
  const double variance = *sigma_mm * *sigma_mm, left = after.squares() / variance, was = before.squares() / variance;
  const auto dof = static_cast<double>(after.dof);
  if (was < kGross * std::max(left, dof) || ChiSquareLaw{after.dof}.probabilityAbove(left / dof) < kAgrees)
    return found;
  const ChiSquareLaw law{unknowns};
  found.chance = std::min(found.chance, law.probabilityAbove((was - left) / static_cast<double>(unknowns)));
  return found;
}

}  // namespace probebox::metrology
