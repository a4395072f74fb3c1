#pragma once
#include <cmath>
#include <numbers>
#include <random>

#include "drivers/world/config.hpp"
#include "drivers/world/machine.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"

// Worlds with a head that swivels otherwise than the control believes, and by how much.
namespace probebox::scenario {

// A head that swivels about some other line, a spindle that leans some other way, styli that hang elsewhere.
inline world::Config swivelWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& head = *config.swivel_head;
  for (const std::size_t i : {0U, 2U}) head.pivot_mm[i] += within(0.05);
  head.direction = {within(3e-4), 1, within(3e-4)};
  auto& spindle = config.probe_spindle;
  spindle.direction = {within(3e-4), within(3e-4), 1};
  for (double& offset : spindle.stylus_offset_mm) offset = within(0.03);
  for (auto& tool : config.further_tools) {
    for (double& offset : tool.offset_mm) offset = within(0.03);
  }
  return config;
}

// From the gauge line to the stylus ball, as machine.toml has it: a pivot 60 mm above, swivelled about Y.
inline world::Vector3 nominalTip(double b_rad, double length_mm) {
  const double arm_mm = 60 + length_mm;
  return {-arm_mm * std::sin(b_rad), 0, 60 - arm_mm * std::cos(b_rad)};
}

// Where the control sees a ball that stands still, less where it sees it at B = 0, half a turn of A averaged out.
inline world::Vector3 errorOf(const world::Machine& machine, double b_rad, std::uint32_t tool, double length_mm) {
  using world::operator*;
  using world::operator+;
  using world::operator-;
  const auto off = [&](double at_rad) {
    const auto one = machine.tipIn({.head_rad = at_rad}, tool);
    const auto other = machine.tipIn({.a_rad = std::numbers::pi, .head_rad = at_rad}, tool);
    return nominalTip(at_rad, length_mm) - 0.5 * (one + other);
  };
  return off(b_rad) - off(0);
}

// The same of the shank: a tool as long as that is high up, in the same spindle, has its tip where the axis of the
// spindle is.
inline world::Vector3 errorOfShank(world::Config config, double b_rad, double length_mm) {
  config.further_tools = {{.number = 9, .length_mm = length_mm}};
  return errorOf(world::Machine{config}, b_rad, 9, length_mm);
}

// Shanks that run out and lean otherwise than that of the board.
inline world::Config shankWorld(std::uint64_t seed) {
  world::Config config = swivelWorld(seed);
  std::mt19937_64 random{seed + 1000};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& shank = *config.probe_spindle.shank;
  for (double& offset : shank.offset_mm) offset = within(0.05);
  for (double& lean : shank.lean) lean = within(2e-3);
  shank.radius_mm += within(0.05);
  shank.lever = 1.1 + within(0.1);
  return config;
}

inline ProcedureOptions byShank(const procedure::LiveMethod& method) {
  return procedure::described(method, {}, usualFacts(), procedure::ReadBy::shank).value();
}

}  // namespace probebox::scenario
