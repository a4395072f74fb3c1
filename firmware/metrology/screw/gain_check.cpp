#include "firmware/metrology/screw/gain_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/screw/screw_config.hpp"

namespace probebox::metrology {
namespace {

// Chosen about 1: the sensor sees the extension of the whole screw.
constexpr double kLeastGain = 0.3, kMostGain = 3.0;
constexpr double kExact_um = 1e-6;  // residuals below are of the digits of a file

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd columnOf(const Table& table, std::string_view name) {
  const auto& values = *table.column(name);
  return Eigen::Map<const VectorXd>{values.data(), static_cast<Index>(values.size())};
}

// A further term of E = K h, and what has it.
struct Term {
  VectorXd values;
  std::string cause;
};

std::vector<Term> termsOf(const Table& table, const ScrewModel& screw) {
  const VectorXd x = columnOf(table, column::kX), ext = columnOf(table, kExtension);
  VectorXd bent = ext;
  for (Index k = 0; k < x.size(); ++k) bent[k] *= std::pow(leverOf(screw, x[k]), 2);
  return {{bent, "a screw that is not evenly warm"},
          {VectorXd::Ones(x.size()), "an error that all readings share"},
          {x.array() - x.mean(), "an error of the scale of the axis, or of what measures error_um"},
          {ext, "a bearing or a bed that grows as well, or an error of orgoff_mm"},
          {VectorXd::LinSpaced(x.size(), -1, 1), "a drift from the first reading to the last"}};
}

// E = K h with further terms, as far as the readings tell them apart.
struct Wider {
  Fit fit;
  std::size_t terms{};
  std::string causes;  // those that explain most by themselves
};

Wider widerFit(const Table& table, const ScrewModel& screw, const Fit& gain) {
  const VectorXd x = columnOf(table, column::kX), ext = columnOf(table, kExtension),
                 errors = columnOf(table, kNutError);
  MatrixXd lever{x.size(), 1};
  for (Index k = 0; k < x.size(); ++k) lever(k, 0) = leverOf(screw, x[k]) * ext[k];
  const VectorXd ones = VectorXd::Ones(x.size());
  MatrixXd design = lever, with_zero{x.size(), 2};
  with_zero << lever, ones;
  Wider wider{gain, 0, {}};
  std::vector<std::pair<double, std::string>> alone;
  for (auto& [term, cause] : termsOf(table, screw)) {
    const auto fitWith = [&](MatrixXd& columns) {
      columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
      columns.rightCols<1>() = term;
      return linearLeastSquares(columns, errors);
    };
    // Each by itself, or with a zero that is off.
    MatrixXd only = term == ones ? lever : with_zero, with = design;
    if (const auto fit = fitWith(only)) alone.emplace_back(fit->sumOfSquares(), std::move(cause));
    const auto fit = fitWith(with);
    // A spare degree more than terms, or the test has no power.
    if (!fit || fit->dof <= wider.terms + 1) continue;
    wider.fit = *fit;
    ++wider.terms;
    design = std::move(with);
  }
  std::ranges::sort(alone);
  for (const auto& [squares, cause] : alone) {
    const bool is_as_likely = static_cast<double>(x.size()) * std::log(squares / alone.front().first) < kAsLikely;
    if (is_as_likely) wider.causes += (wider.causes.empty() ? "" : "; or ") + cause;
  }
  return wider;
}

}  // namespace

std::vector<std::string> gainDoubts(const Table& table, const ScrewModel& screw, const Fit& gain) {
  std::vector<std::string> doubts;
  const double k = gain.parameters[0];
  if (std::abs(k) < kLeastGain || std::abs(k) > kMostGain)
    doubts.push_back("K is " + text(k) + ", outside 0.3 to 3: check whether columns are exchanged, their units and " +
                     "screw_length_mm");
  const double squares = gain.sumOfSquares();
  if (squares <= static_cast<double>(table.rows()) * kExact_um * kExact_um) return doubts;
  const Wider wider = widerFit(table, screw, gain);
  if (wider.terms == 0) return doubts;
  const double left = wider.fit.sumOfSquares() / static_cast<double>(wider.fit.dof);
  const double taken = (squares - wider.fit.sumOfSquares()) / static_cast<double>(wider.terms);
  if (ChiSquareLaw{wider.terms, wider.fit.dof}.probabilityAbove(taken / left) >= kFalseAlarm) return doubts;
  doubts.push_back("the true errors do not follow K alone, by " +
                   text(std::sqrt(squares / static_cast<double>(gain.dof))) +
                   " um: look for a wrong row of ext_um or error_um; such errors are left by " + wider.causes);
  return doubts;
}

}  // namespace probebox::metrology
