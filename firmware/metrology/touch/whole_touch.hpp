#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/touch/bounce.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One touch on its whole record, way in, rest and way out, along the direction u of its retract (CN101622513,
// docs/metrology.md A.3b). With y = u . x of the machine, and the deflection D in the direction that the touch bends
// the stylus,
//   D(t) = g (h + k h^2),   h(t) = p - y(t + tau) + bounce(t)
// where p is the place of the surface, g the gain, k its bend, and y runs along straight lines between the ramps.

// Noise of one sample of a stream along the motion. Jitter of the stamps adds to that of a motion.
struct StreamNoise {
  double moving{};       // sd, unit of the stream
  double at_rest{};      // sd
  double correlation{};  // of neighbouring samples, r; r^m at m samples
};
struct RecordNoise {
  StreamNoise machine;
  StreamNoise probe;
};

// Squared residuals of some samples, with what the fitted unknowns take of their expectation.
struct Leftover {
  double squares{};
  double products{};  // of neighbours
  double count{};
  double leverage{};
  double shared{};  // of the products

  Leftover& operator+=(const Leftover& other);
  double dof() const { return count - leverage; }
};

enum class State { in, rest, out };
inline constexpr std::array kStates{State::in, State::rest, State::out};

struct WholeTouch {
  TouchPlan plan;
  bool has_way_in{};           // else tau_s is the one that was stated
  Eigen::Vector4d values;      // tau (s), p (mm along the retract), g (raw units per mm), k (per mm)
  Eigen::Matrix4d covariance;  // of the readings' noise
  Eigen::Vector3d surface;     // mm: the tip where it meets the surface, the delay taken out
  Eigen::Vector3d channels;    // unit vector of the deflection
  double across_variance{};    // mm^2, of the surface across the drive
  double speed_in_mm_s{};      // along the retract, positive
  double speed_out_mm_s{};
  // Lost motion along the drive by where the machine stands at rest, between its ways; variance 0 where it did not
  // rest.
  double lost_at_rest_mm{};
  double lost_at_rest_variance{};
  // By the machine's stamps, from the first to the last sample at rest; equal where it did not rest.
  double rest_from_s{};
  double rest_until_s{};
  std::optional<Bounce> bounce{};
  double bounce_gain{};               // of chi-square, by any bounce at all
  std::array<Leftover, 3> machine{};  // by State
  std::array<Leftover, 3> probe{};
  std::size_t left_out{};  // samples of the probe that are far off

  double tau_s() const { return values[0]; }
  double surface_mm() const { return values[1]; }
};

// Reads the stretches of constant speed of a record once (touch_record.cpp), for several fits (whole_touch.cpp).
class TouchRecord {
 public:
  // Refuses: no-contact, speed-not-constant (no straight way out while the stylus is deflected), truncated.
  static Outcome<TouchRecord, Refusal> read(const Touch& touch, const StampJitter& jitter);

  // Of the streams alone, before any fit.
  const RecordNoise& noise() const { return noise_; }
  // Smallest sd that the resolution of the streams allows.
  const RecordNoise& leastNoise() const { return least_; }
  bool hasWayIn() const { return has_way_in_; }

  // Maximum likelihood by Gauss-Newton. usual: frequency and decay of the bounce of other touches, 0
  // where none bounced; with amplitudes, of this touch as an earlier fit found it. Without the way in, tau_s has to be
  // given. Refuses: too-few-samples, no-convergence.
  Outcome<WholeTouch, Refusal> fit(const RecordNoise& noise, const Bounce& usual = {},
                                   std::optional<double> tau_s = std::nullopt) const;

 private:
  struct Stretch {
    Run run;
    State state;
    Line line;
  };
  class Solver;
  // The samples of the probe while the stylus is pressed on.
  struct Pressed {
    double rest{};        // deflection at rest
    std::size_t first{};  // above a level of it
    std::size_t last{};   // first of those that stay below
  };

  Refusal refused(const char* name, const char* what) const { return {name, plan_.name + ": " + what}; }
  Outcome<Pressed, Refusal> pressed() const;
  void setLeastNoise();
  void findStretches();
  const Stretch* way(State state) const;  // the one beside the rest
  std::optional<Refusal> findStart(const Pressed& pressed);

  TouchPlan plan_;
  Stream machine_;
  Stream probe_;
  std::vector<double> place_;       // of the machine along the retract, mm
  std::vector<double> deflection_;  // raw, along the direction of the touch
  Eigen::Vector3d channels_;        // unit vector of that direction
  std::vector<Stretch> stretches_;
  RecordNoise noise_;
  RecordNoise least_;
  bool has_way_in_{};
  Eigen::Vector4d start_;  // of the values
  double depth_mm_{};
};

}  // namespace probebox::metrology
