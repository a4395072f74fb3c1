#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/angle_table.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// E(B, L) = (sine + L sine_per_mm) sin B + (rest + L rest_per_mm) (1 - cos B): common form of (B19), (B20) and (B21).
// mm, machine axes; B in the sense of the control.
struct SwivelTerms {
  Eigen::Vector3d sine = Eigen::Vector3d::Zero();
  Eigen::Vector3d sine_per_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  Eigen::Vector3d rest_per_mm = Eigen::Vector3d::Zero();

  Eigen::Vector3d at(double swivel_rad, double length_mm) const;
};

// Computes the correction of a swivelling head at every tick (docs/metrology.md F). Does not allocate after
// construction.
class SwivelCorrection {
 public:
  // left: residuals by angle that are added; nullopt for none.
  explicit SwivelCorrection(const SwivelTerms& terms, const std::optional<AngleTable<3>>& left = {})
      : terms_{terms}, left_{left} {}

  // From a result of swivel-error: its swivel_terms_mm and, with `by_angle`, the residuals of its readings by angle
  // (left_by_angle_mm: an index error of B). Refuses: wrong-result, and what AngleTable::make refuses.
  static Outcome<SwivelCorrection, Refusal> from(const Result& result, bool by_angle);

  // + E(B, L), mm. swivel: rad; length: mm, of the tool in the spindle. nullopt without one of them, or outside the
  // angles of the table: a correction without inputs is invalid, never zero.
  std::optional<Eigen::Vector3d> at(std::optional<double> swivel_rad, std::optional<double> length_mm) const;

 private:
  SwivelTerms terms_;
  std::optional<AngleTable<3>> left_;
};

}  // namespace probebox::metrology
