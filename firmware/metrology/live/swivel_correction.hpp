#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/angle_table.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// E(B, L) = (sine + L sine_per_mm) sin B + (rest + L rest_per_mm) (1 - cos B): what (B19), (B20) and (B21) have in
// common. mm, machine axes; B in the sense of the control.
struct SwivelTerms {
  Eigen::Vector3d sine = Eigen::Vector3d::Zero();
  Eigen::Vector3d sine_per_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  Eigen::Vector3d rest_per_mm = Eigen::Vector3d::Zero();

  Eigen::Vector3d at(double swivel_rad, double length_mm) const;
};

// What a swivelling head adds to the commanded tool point, at every tick (docs/metrology.md F). Allocates nothing after
// it was made.
class SwivelCorrection {
 public:
  // left: what is left at each angle, and added too; nothing for none.
  explicit SwivelCorrection(const SwivelTerms& terms, const std::optional<AngleTable<3>>& left = {})
      : terms_{terms}, left_{left} {}

  // From what the method swivel-error answered: its swivel_terms_mm. With `by_angle`, what its readings have left at
  // each angle is added too (left_by_angle_mm: an index error of B). Refuses: wrong-result, and what AngleTable::make
  // does.
  static Outcome<SwivelCorrection, Refusal> from(const Result& result, bool by_angle);

  // + E(B, L), mm. swivel: rad, of encoder, register or marker; length: mm, of the tool that is in the spindle. Nothing
  // without one of them, or beyond the angles of the table: without its inputs a correction is invalid, never zero.
  std::optional<Eigen::Vector3d> at(std::optional<double> swivel_rad, std::optional<double> length_mm) const;

 private:
  SwivelTerms terms_;
  std::optional<AngleTable<3>> left_;
};

}  // namespace probebox::metrology
