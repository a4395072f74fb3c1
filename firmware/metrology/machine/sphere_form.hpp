#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

// Form of a touched sphere by direction: of the sphere, the stylus ball and the probe together.
namespace probebox::metrology {

// Components of the form that are fitted, each times the sine of the angle to the stylus, outwards positive.
inline constexpr std::string_view kLobeNames[]{"2 lobes, cosine", "2 lobes, sine", "3 lobes, cosine",  "3 lobes, sine",
                                               "4 lobes, cosine", "4 lobes, sine", "across the stylus"};
inline constexpr Eigen::Index kLobes = std::size(kLobeNames);

// Some directions determine the lobes only where they are close enough around the stylus. Refuses: few-directions.
std::optional<Refusal> refuseDirections(std::span<const Eigen::Vector3d> directions);

// Centre, radius and lobes (A28), mm.
struct SphereForm {
  Eigen::Vector3d centre_mm, sd_centre_mm;  // from where the places are counted
  double radius_mm{}, sd_radius_mm{};
  Eigen::Vector<double, kLobes> lobes_mm, sd_lobes_mm;
  Eigen::VectorXd found_mm;     // of each direction, from the sphere
  Eigen::VectorXd sd_found_mm;  // of its place alone
  Eigen::VectorXd by_lobes_mm;
  bool explained{};  // noise may have left what the lobes do not explain
};

// places_mm: of the surface along each direction, outwards, with their covariance, known by so many degrees of freedom.
// Refuses: few-directions, where they do not tell the lobes from the place.
Outcome<SphereForm, Refusal> fitSphereForm(std::span<const Eigen::Vector3d> directions,
                                           const Eigen::VectorXd& places_mm, const Eigen::MatrixXd& covariance,
                                           std::size_t noise_dof);

// One touch of one direction.
struct FormReading {
  Eigen::Vector3d direction;
  double place_mm{};     // along it
  double expected_mm{};  // without its noise, by the form; from any sphere
  double sd_mm{};        // of its noise
};
struct FormRange {
  double value_mm{};
  double sd_mm{};  // by draws of the noise, the same ones for the same readings
};
// P_FTU of ISO 10360-5: range of what touches miss the sphere by that is fitted to them with equal weights. across: of
// ISO 230-10, P_FTU,2D, of directions across the stylus about a circle; others do not count. Nothing for fewer than
// four readings more than there are unknowns.
std::optional<FormRange> formRange(std::span<const FormReading> readings, bool across);

}  // namespace probebox::metrology
