#include "firmware/metrology/delay/drive_checks.hpp"

#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/free_stylus.hpp"
#include "firmware/metrology/touch/stamp_jumps.hpp"

namespace probebox::metrology {
namespace {

constexpr double kSpeedOfDrive = 0.2;  // share that it may differ from the nominal one

// A drive without a rest takes as long from half the deflection to none as from the apex to half of it.
std::optional<Refusal> notAtZeroBeside(const Touch& touch) {
  const Stream& probe = touch.probe;
  const Eigen::VectorXd size = probe.values.rowwise().norm();
  Eigen::Index deepest = 0;
  const double highest = size.maxCoeff(&deepest);
  Eigen::Index half = deepest;
  while (half + 1 < size.size() && size[half] > 0.5 * highest) ++half;
  const double apex_s = probe.times[static_cast<std::size_t>(deepest)];
  const double fall_s = 2.0 * (probe.times[static_cast<std::size_t>(half)] - apex_s);
  if (!(fall_s > 0.0)) return std::nullopt;
  return notAtZero(
      touch, {.at_s = apex_s + fall_s, .fall_s = fall_s, .units_per_mm = highest / (fall_s * touch.plan.speed_mm_s)});
}

}  // namespace

std::optional<Refusal> badDrive(const Touch& touch, const StampJitter& jitter, ProbeZero zero) {
  const Despiked machine = withoutSpikes(touch.machine, jitter.machine_s);
  const Despiked probe = withoutSpikes(touch.probe, jitter.probe_s);
  const Touch clean{touch.plan, machine.stream, probe.stream};
  if (auto bad = stampsJump(clean, jitter.machine_s)) return bad;
  return zero == ProbeZero::known ? notAtZeroBeside(clean) : std::nullopt;
}

std::optional<Refusal> speedOfDriveDiffers(const TouchPlan& plan, double speed_mm_s) {
  if (std::abs(speed_mm_s - plan.speed_mm_s) <= kSpeedOfDrive * plan.speed_mm_s) return std::nullopt;
  return Refusal{"speed-differs", plan.name + ": the machine drives at " + text(speed_mm_s) + " mm/s where " +
                                      text(plan.speed_mm_s) +
                                      " is stated; set the feed override to 100 %, or correct the time stamps"};
}

}  // namespace probebox::metrology
