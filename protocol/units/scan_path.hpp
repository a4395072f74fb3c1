#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace probebox {

// Path of a scan: how the centre of the stylus ball is led around a ball, in contact all the way, in the plane of X and
// Y through its middle. Arcs alternate between two depths; a short straight way leads from each to the next. Chords are
// straight ways between points at the first depth.
struct ScanPath {
  static constexpr std::size_t kMostArcs = 8;
  std::array<double, 2> depths_mm{};  // from where contact begins towards the middle
  double start_rad{};                 // direction from the middle, from X to Y
  double ramp_rad{};                  // of the ways between two arcs
  double sense{};                     // 1: from X to Y, or -1
  bool chords{};
  std::uint8_t count{};  // of the arcs or chords; 0: no scan
  std::array<double, kMostArcs> arcs_rad{};
};

// One way of a scan.
struct ScanWay {
  bool is_arc{};
  double turn_rad{};     // signed by the sense
  double to_depth_mm{};  // at its end
};

constexpr std::size_t waysOf(const ScanPath& scan) {
  if (scan.count == 0) return 0;
  const std::size_t arcs = scan.count;
  return scan.chords ? arcs : 2 * arcs - 1;
}

// way: from 0, less than waysOf(scan).
constexpr ScanWay wayOf(const ScanPath& scan, std::size_t way) {
  if (scan.chords) return {false, scan.sense * scan.arcs_rad[way], scan.depths_mm[0]};
  const bool is_arc = way % 2 == 0;
  const std::size_t level = (way + 1) / 2 % 2;
  return {is_arc, scan.sense * (is_arc ? scan.arcs_rad[way / 2] : scan.ramp_rad), scan.depths_mm[level]};
}

constexpr double turnOf(const ScanPath& scan) {
  double turn_rad = 0;
  for (std::size_t way = 0; way < waysOf(scan); ++way) turn_rad += wayOf(scan, way).turn_rad;
  return turn_rad;
}

}  // namespace probebox
