#include "firmware/metrology/checks/likely_causes.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"
#include "firmware/metrology/uncertainty/machine_errors.hpp"

namespace probebox::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostChance = 0.01;
constexpr double kLeastShare = 0.5;   // of what the noise does not explain
constexpr double kOffSize_mm = 5e-3;  // a ball of another kind, or worn

// By the name of the error.
using Causes = std::map<std::string, std::vector<TypeBInput>, std::less<>>;

Causes causesOf(const Dataset& dataset, const Method& method) {
  Causes causes;
  for (auto& input : suspectedErrors(dataset, method)) causes[input.name].push_back(std::move(input));
  for (const auto& known : method.known) {
    if (known.kind != KnownKind::size && known.kind != KnownKind::column && known.kind != KnownKind::value) continue;
    if (!known.key.ends_with("_mm")) continue;
    Dataset stating = dataset;
    stating.config[std::string{known.sd_key}] = kOffSize_mm;
    const auto inputs = typeBInputs(stating, method);
    if (!inputs) continue;
    for (const auto& input : *inputs)
      if (input.name == known.sd_key) causes[std::string{known.key}].push_back(input);
  }
  return causes;
}

// Names of the errors without which a refused case is solved: each of its usual size, one way or the other, of all axes
// together, because every try is a whole solution; of lobes, cosine and sine alone too.
std::string thoseThatRefuse(const Dataset& dataset, const Method& method) {
  const auto isSolved = [&](const std::vector<TypeBInput>& without) {
    return std::ranges::any_of(std::array{1.0, -1.0}, [&](double by) {
      Dataset moved = dataset;
      for (const auto& input : without) input.move(moved, by);
      return method.solver(moved).ok();
    });
  };
  const auto isSolvedByPart = [&](const std::vector<TypeBInput>& inputs) {
    return std::ranges::any_of(inputs, [&](const auto& input) { return isSolved({input}); });
  };
  std::string names;
  for (const auto& [cause, inputs] : causesOf(dataset, method))
    if (isSolved(inputs) || (cause == kLobing && isSolvedByPart(inputs)))
      names += (names.empty() ? "" : "; or ") + causeName(cause);
  return names;
}

// The case without the sigma that refuses residuals.
Dataset unrefused(Dataset dataset) {
  dataset.config.erase(std::string{key::kSigma.name});
  return dataset;
}

std::optional<VectorXd> residualsOf(const Solved& solved) {
  if (!solved || solved->residuals.values.empty()) return std::nullopt;
  return VectorXd::Map(solved->residuals.values.data(), std::ssize(solved->residuals.values));
}

// What each input changes the residuals by; those that do not are left out.
std::vector<VectorXd> changesBy(const std::vector<TypeBInput>& inputs, const VectorXd& residuals,
                                const Dataset& dataset, const Method& method) {
  constexpr double kStep = 0.1, kSeen = 1e-4;  // in sd of the input, and of the residuals
  std::vector<VectorXd> changes;
  for (const auto& input : inputs) {
    for (const double by : {input.whole_step ? 1 : kStep, kStep, -kStep}) {
      Dataset moved = dataset;
      input.move(moved, by);
      const auto after = residualsOf(method.solver(moved));
      if (!after || after->size() != residuals.size()) continue;
      VectorXd change = *after - residuals;
      if (change.norm() > kSeen * residuals.norm()) changes.push_back(std::move(change));
      break;
    }
  }
  return changes;
}

struct Explained {
  double squares{};  // that are left
  std::size_t unknowns{};
};

// Takes one change after the other, that which explains most first, as long as it counts and half of the degrees of
// freedom are left.
Explained explain(const VectorXd& residuals, std::vector<VectorXd> changes, std::size_t dof) {
  constexpr double kLess = 0.9;  // of what is left
  Explained explained{residuals.squaredNorm(), 0};
  MatrixXd design{residuals.size(), 0};
  while (!changes.empty() && 2 * (explained.unknowns + 1) <= dof) {
    MatrixXd best;
    double least = kLess * explained.squares;
    for (const auto& change : changes) {
      MatrixXd with{design.rows(), design.cols() + 1};
      with << design, change;
      const auto fit = linearLeastSquares(with, residuals);
      if (!fit || fit->sumOfSquares() >= least) continue;
      least = fit->sumOfSquares();
      best = std::move(with);
    }
    if (best.size() == 0) break;
    design = std::move(best);
    explained = {least, explained.unknowns + 1};
  }
  return explained;
}

}  // namespace

std::string causeName(std::string_view cause) {
  for (const auto& error : kMachineErrors)
    if (error.key == cause) return error.name;
  if (cause == kCurvature) return "curvature of the probe's gain";
  if (cause == kLobing) return "lobing of the probe, or the form of what is touched";
  if (cause == kErrorMotion) return "error motion of C, twice a turn";
  return "an error of " + std::string{cause};
}

std::optional<std::string> likelyCauses(const Dataset& dataset, const Method& method, double sigma_mm) {
  const Dataset known = unrefused(atTemperature(dataset, method));
  const auto solved = method.solver(known);
  const std::string refusing = solved ? "" : thoseThatRefuse(known, method);
  if (!refusing.empty()) return "without one of these errors it is solved: " + refusing;
  const auto residuals = residualsOf(solved);
  if (!residuals) return std::nullopt;
  const auto law = lawOf(*solved);
  const std::size_t dof = std::min(law ? law->dof : solved->dof, static_cast<std::size_t>(residuals->size()));
  const double squares = residuals->squaredNorm();
  std::map<std::string, Explained> explained;
  double variance = sigma_mm * sigma_mm, likeliest = HUGE_VAL;
  std::size_t noise_dof = 0;
  for (const auto& [cause, inputs] : causesOf(known, method)) {
    const auto found = explain(*residuals, changesBy(inputs, *residuals, known, method), dof);
    if (found.unknowns == 0) continue;
    explained[cause] = found;
    const double left = found.squares / static_cast<double>(dof - found.unknowns);
    if (left >= likeliest) continue;
    likeliest = left;
    noise_dof = dof - found.unknowns;
  }
  if (explained.empty()) return std::nullopt;
  // The stated noise, unless the best of them leaves more.
  if (variance > 0 && ChiSquareLaw{noise_dof}.probabilityAbove(likeliest / variance) > kMostChance)
    noise_dof = 0;
  else
    variance = likeliest;
  const double excess = squares - static_cast<double>(dof) * variance;
  std::vector<std::pair<double, std::string>> found;
  for (const auto& [cause, left] : explained) {
    const auto unknowns = static_cast<double>(left.unknowns);
    const double less = (squares - left.squares) / variance;
    if (squares - left.squares < kLeastShare * excess) continue;
    if (ChiSquareLaw{left.unknowns, noise_dof}.probabilityAbove(less / unknowns) > kMostChance) continue;
    found.emplace_back(less - 2 * unknowns, causeName(cause));
  }
  if (found.empty()) return std::nullopt;
  std::ranges::sort(found, std::ranges::greater{});
  std::string names;
  for (const auto& [score, name] : found)
    if (score > found.front().first - kAsLikely) names += (names.empty() ? "" : "; or ") + name;
  return "such residuals are left by: " + names;
}

void nameLikelyCauses(const Dataset& dataset, const Method& method, Result& result) {
  constexpr std::array kOfResiduals{kResidualsExceedNoise, kResidualsShowAPattern, kResidualsCorrelated,
                                    kReadingsContradict};
  const auto isOfResiduals = [&](const std::string& warning) {
    return std::ranges::any_of(kOfResiduals, [&](auto name) { return warning.starts_with(name); });
  };
  const auto warning = std::ranges::find_if(result.warnings, isOfResiduals);
  if (warning == result.warnings.end()) return;
  double sigma_mm = 0;
  if (result.chi2_reduced && *result.chi2_reduced > 0) {
    const auto law = lawOf(result);
    const auto& values = result.residuals.values;
    const double squares = VectorXd::Map(values.data(), std::ssize(values)).squaredNorm();
    sigma_mm = std::sqrt(squares / static_cast<double>(law ? law->dof : result.dof) / *result.chi2_reduced);
  }
  if (const auto causes = likelyCauses(dataset, method, sigma_mm)) *warning += "; " + *causes;
}

}  // namespace probebox::metrology
