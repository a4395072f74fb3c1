#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/kinematics/kinematics.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Columns of table legs, one row per leg: kind and position of its joint, lower and upper end, direction of a slide or
// a crank's axis, a point of that axis.
inline constexpr MethodColumn kLegColumns[]{column::number("kind"), column::given("q"),     column::given("lx_mm"),
                                            column::given("ly_mm"), column::given("lz_mm"), column::given("px_mm"),
                                            column::given("py_mm"), column::given("pz_mm"), column::kAlongX,
                                            column::kAlongY,        column::kAlongZ,        column::given("cx_mm"),
                                            column::given("cy_mm"), column::given("cz_mm")};

// Effect of the joint of a leg: it changes the length of the strut, or moves the lower end of a strut of fixed length.
enum class LegKind : std::uint8_t { strut, slide, crank };

// One leg in the platform's reference pose.
struct Leg {
  LegKind kind{};
  double q{};                 // its joint position then, mm; rad of a crank
  Eigen::Vector3d lower;      // lower end of the strut, mm: on the base, or on the part that the joint moves
  Eigen::Vector3d upper;      // on the platform
  Eigen::Vector3d direction;  // unit: along the slide, or right-handed about the crank's axis
  Eigen::Vector3d pivot;      // on the crank's axis

  Eigen::Vector3d lowerAt(double joint) const;
  double lengthAt(double joint) const;
  // Speed of the strut's upper end along the strut per unit of the joint, mm. along: unit vector from the lower to the
  // upper end.
  double pushOf(double joint, const Eigen::Vector3d& along) const;
};

// Forward kinematics of a platform on legs (docs/metrology.md A.6c, (A21b)): a delta with three arms, whose platform
// keeps its orientation, or a hexapod with six legs.
class ParallelKinematics final : public Kinematics {
 public:
  // tip: mm, in the reference pose. legs: three or six.
  ParallelKinematics(std::vector<Leg> legs, const Eigen::Vector3d& tip);

  // Reads table legs{kind,q,lx_mm,ly_mm,lz_mm,px_mm,py_mm,pz_mm,ux,uy,uz,cx_mm,cy_mm,cz_mm}, one row per leg, and
  // config tip_mm. Refuses what checkedTable refuses, and: missing-key, bad-config, bad-flag, bad-direction, bad-legs.
  static Outcome<ParallelKinematics, Refusal> read(const Dataset& dataset);

  Eigen::Index size() const override { return static_cast<Eigen::Index>(legs_.size()); }
  std::vector<std::string> columns() const override;
  // The pose reached from the reference pose without passing a singular one.
  std::optional<Eigen::Vector3d> reached(const Eigen::VectorXd& q) const override;
  Eigen::Matrix3Xd jacobian(const Eigen::VectorXd& q) const override;

 private:
  // At most six of each, on the stack.
  using PerLeg = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  using ByLeg = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  struct Pose {
    Eigen::Vector3d tip;
    Eigen::Matrix3d turned{Eigen::Matrix3d::Identity()};
  };
  Eigen::Vector3d strutOf(Eigen::Index leg, const Pose& pose, double q) const;
  PerLeg gaps(const Pose& pose, const PerLeg& q) const;
  // Motion of the upper ends along their struts, one row per leg: by translations, and by rotations about the tip in mm
  // at distance arm_mm_.
  ByLeg carried(const Pose& pose, const PerLeg& q) const;
  std::optional<Pose> closed(Pose pose, const PerLeg& q) const;
  std::optional<Pose> poseAt(const PerLeg& q) const;

  std::vector<Leg> legs_;
  Eigen::Vector3d tip_;
  double arm_mm_{};  // mean distance of the upper ends from the tip
};

}  // namespace probebox::metrology
