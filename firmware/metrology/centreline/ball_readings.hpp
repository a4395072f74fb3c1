#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A ball turned by the C axis, measured in the plane by a probe turned by the spindle.
struct BallReading {
  Eigen::Vector2d at;  // mm
  double spindle{};    // rad, right-handed about +Z (the sources call it A)
  double c{};          // rad, right-handed about +Z
  std::size_t set{};   // of readings at one height or tip length
  double lever{};      // that height or length, about the mean of all readings; mm
  // Unit vector of the side touched by a shank: the reading counts along it only, and is further out by the radii of
  // ball and shank, the same for every touch of a set (B16). All readings of a set have a side, or none.
  std::optional<Eigen::Vector2d> shank_side{};
  double spread{1.0};            // its sd, in units of sigma
  double stop{};                 // number of the stop of C, at which it was read
  Eigen::Vector2d beyond{0, 0};  // from the fitted ball to the one that was read, at C = 0; mm
};

// Model (B4): m = o + R2(C) r - R2(A) s. o: C axis minus spindle axis; r: offset of the ball from C; s: offset of the
// stylus from the spindle. Linear; which of these can be separated depends on the readings.
struct BallModel {
  bool sloped{};          // o changes with the lever: o + k lever
  bool arm_per_set{};     // each set has its own r (a ball of its own)
  bool stylus_per_set{};  // each set has its own s (its own tip)
};

enum class Turned {
  both,         // o, r, s
  together,     // o, r - s
  c_only,       // o - R2(A) s, r
  spindle_only  // o + R2(C) r, s
};

// The rows of one reading in the fit.
inline constexpr MethodColumn kBallParts[]{column::kX, column::kY};

struct BallFit {
  Fit fit;  // parameters: o (0, 1), k (2, 3) when sloped, then the arms and styli that are in the model
  Turned turned{Turned::both};
  Eigen::Index arms{};   // column of the first arm; -1: not in the model
  Eigen::Index styli{};  // column of the first stylus offset; -1: not in the model
};

// noise.angle: of each stop of C; all readings of one stop are off by it together, along their arms' tangents, which
// takes a C that turned. Its size is stated, not fitted. Refuses: angles-too-close (neither axis turned, or o or k more
// than 20 times less certain than a reading, |sin(alpha/2)| < 0.05 for two angles), spindle-not-turned or c-not-turned
// (needed to separate k), implausible (a stylus 10 mm off the spindle), and what linearLeastSquares refuses.
Outcome<BallFit, Refusal> fitBall(std::span<const BallReading> readings, const BallModel& model,
                                  const RotationNoise& noise);

struct BallColumns {
  std::string_view table{"readings"};
  std::string_view lever{};  // empty: none
  std::vector<std::string_view> further{};
  std::string_view parted_by{};  // column by which rows with the same lever are parted into sets; empty: none
  double same_lever_mm{};  // levers within this of the first of a set are of that set: of levers that are measured
};

// Column that numbers the stops of C, where a method has it: rows with one number were read without C turning in
// between.
inline constexpr MethodColumn kStop = column::kStop.orBe(MayBe::missing);

// Table{<lever>,A_rad,C_rad,x_mm,y_mm} and further columns. Config: A_sense, C_sense. Rows with the same lever form a
// set, unless `parted_by` parts them, and have the mean of its levers; levers are relative to their mean, `mean_lever`.
// Without a column `stop` each change of C from row to row begins a stop.
struct BallTable {
  std::vector<BallReading> readings;
  std::vector<std::string> warnings;
  std::vector<double> levers;  // of the sets
  double mean_lever{};

  double leverSpan() const;
  // Makes levers relative to the mean of all readings.
  void centreLevers();
};
Outcome<BallTable, Refusal> readBallTable(const Dataset& dataset, const BallColumns& named);

}  // namespace probebox::metrology
