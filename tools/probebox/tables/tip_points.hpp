#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/link/recording.hpp"

namespace probebox::command {

// One sample as a place: (A20) P = x + A d, and where the ball touches the surface. NaN where a value is unknown.
struct TipPoint {
  std::array<double, 3> tip_mm{};  // centre of the stylus' ball, machine position
  std::array<double, 3> sd_tip_mm{};
  std::array<double, 3> normal{};  // of the surface, towards the ball
  std::array<double, 3> surface_mm{};
  std::array<double, 3> sd_surface_mm{};
  double sd_along_normal_mm{};  // of the surface; the three above are correlated where the normal is uncertain

  bool hasTip() const { return tip_mm[0] == tip_mm[0]; }
};

// Columns of a point, in the order of every format.
inline constexpr std::array<std::string_view, 16> kPointColumns{
    "tip_x_mm",        "tip_y_mm",        "tip_z_mm",        "sd_tip_x_mm",       "sd_tip_y_mm",  "sd_tip_z_mm",
    "normal_x",        "normal_y",        "normal_z",        "surface_x_mm",      "surface_y_mm", "surface_z_mm",
    "sd_surface_x_mm", "sd_surface_y_mm", "sd_surface_z_mm", "sd_along_normal_mm"};
std::array<double, kPointColumns.size()> valuesOf(const TipPoint& point);

// Computes the points of one block after another, and counts why some are missing.
class TipPoints {
 public:
  // friction: the largest coefficient that ball and surface may have. A tip that rests has an uncertain normal by it;
  // one that is dragged by more does not slide along a surface.
  explicit TipPoints(double friction) : friction_{friction} {}

  // Returns the point of sample k of a block. Blocks come in the order of the recording.
  const TipPoint& of(const link::DecodedBlock& block, std::size_t k);

  // Samples without a value, and why.
  struct Missing {
    std::string_view what;  // "tip", "sd" or "surface"
    std::int64_t first{};
    std::uint64_t samples{};
  };
  const std::map<std::string, Missing>& missing() const { return missing_; }
  std::uint64_t tips() const { return tips_; }
  std::uint64_t surfaces() const { return surfaces_; }

 private:
  void take(const link::DecodedBlock& block);
  struct Body {
    std::int64_t sample{};
    double time_s{};
    std::array<double, 3> mm{};
    std::array<double, 3> channels_mm{};
    std::array<double, 3> pushed_mm{};  // A d
    bool clipped{};
  };
  void computeBodies(const link::DecodedBlock& block);
  void measureScatter();
  void compute(const messages::Descriptor& descriptor, std::size_t k);
  void addSurface(const messages::Descriptor& descriptor, std::size_t k, const std::array<double, 3>& pushed_variance);
  struct Reach {
    std::size_t from{}, to{};  // bodies
  };
  Reach reachOf(std::size_t k) const;
  double secondsOf(Reach reach) const { return bodies_[reach.to].time_s - bodies_[reach.from].time_s; }
  std::array<double, 3> wayOf(Reach reach, bool of_tip) const;
  void lack(std::string_view what, const std::string& why, std::int64_t sample);

  double friction_;
  std::optional<MonoTime> taken_;  // time of the first sample of the block that was taken
  std::vector<TipPoint> points_;
  std::vector<Body> bodies_;            // of the block, after those kept of the one before
  std::size_t first_{};                 // body of the block's first sample
  std::array<double, 3> scatter_mm_{};  // sd of a machine position: the encoder's noise
  std::array<std::size_t, 7> columns_{};
  std::map<std::string, Missing> missing_;
  std::uint64_t tips_{}, surfaces_{};
};

// Explains why no sample of this descriptor has a tip; nullopt when samples have one.
std::optional<std::string> whyNoTip(const messages::Descriptor& descriptor);
// The same of its standard deviation, where it has a tip.
std::optional<std::string> whyNoSd(const messages::Descriptor& descriptor);

}  // namespace probebox::command
