#include "firmware/metrology/screw/gain_check.hpp"

#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/screw/screw_config.hpp"

namespace probebox::metrology {
namespace {

// Chosen about 1: the sensor sees the extension of the whole screw.
constexpr double kLeastGain = 0.3, kMostGain = 3.0;
constexpr double kExact_um = 1e-6;  // residuals below are of the digits of a file

using Eigen::Index;
using Eigen::VectorXd;

VectorXd columnOf(const Table& table, std::string_view name) {
  const auto& values = *table.column(name);
  return Eigen::Map<const VectorXd>{values.data(), static_cast<Index>(values.size())};
}

// E = K h with further terms, as far as the readings tell them apart.
struct Wider {
  Fit fit;
  std::size_t terms{};
};

Wider widerFit(const Table& table, const ScrewModel& screw, const Fit& gain) {
  const VectorXd x = columnOf(table, column::kX), ext = columnOf(table, kExtension),
                 errors = columnOf(table, kNutError);
  Eigen::MatrixXd design{x.size(), 1};
  for (Index k = 0; k < x.size(); ++k) design(k, 0) = leverOf(screw, x[k]) * ext[k];
  Wider wider{gain, 0};
  for (const VectorXd& term : {VectorXd::Ones(x.size()).eval(), VectorXd{x.array() - x.mean()}, ext}) {
    Eigen::MatrixXd with{design.rows(), design.cols() + 1};
    with << design, term;
    const auto fit = linearLeastSquares(with, errors);
    if (!fit || fit->dof == 0) continue;
    wider = {*fit, wider.terms + 1};
    design = std::move(with);
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
                   " um: look for a wrong row of ext_um or error_um, or a screw that is not evenly warm");
  return doubts;
}

}  // namespace probebox::metrology
