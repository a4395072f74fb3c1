#include "firmware/procedure/plan/rates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "firmware/metrology/scan/scan_points.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"

namespace probebox::procedure {
namespace {

// On either way of a touch without a dwell, over the part of it that no round apex bends: three, and one for its ends.
constexpr double kOnAWay = 4;
constexpr double kShareOfWay = 0.85;

constexpr double kSlowest_mm_s = 0.5;     // of a touch
constexpr double kOfAMeasurement = 0.99;  // of the true rate: stamps jitter

NeededRates ofTouch(const Step& step) {
  using Needs = metrology::RetractNeeds;
  const double speed = step.touch.retract_speed_mm_s, depth_mm = step.overtravel_mm;
  const double way_mm = std::min(Needs::kUntil * depth_mm, depth_mm + step.clearance_mm + step.run_out_mm);
  return {.positions_hz = Needs::kPositions * speed / (way_mm - Needs::kFrom * depth_mm),
          .deflections_hz = Needs::kDeflections * speed / ((Needs::kHighest - Needs::kLowest) * depth_mm)};
}

NeededRates ofScan(const Step& step, const Facts& facts) {
  const double way_mm = facts.sphereReach_mm().value_or(0) * std::abs(turnOf(step.touch.scan));
  if (way_mm == 0) return {};
  const double hz = static_cast<double>(metrology::kLeastOfContour) * step.touch.retract_speed_mm_s / way_mm;
  return {hz, hz};
}

bool readsProbe(const Step& step) {
  return !step.touch.sweeps && !step.touch.by_edges;
}

struct Shortfall {
  const Step* step{};
  double needed_hz{};
};

Error nothingArrives(const std::string& samples, const std::string& where) {
  return Error{"No " + samples + " arrive, and the run reads them: probebox status shows what is wrong with their " +
               "source (" + where + ")."};
}

// As people write numbers: none by a power of ten that has whole hertz.
std::string inWords(double hz) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), hz < 100 ? "%.3g" : "%.0f", std::min(hz, 1e12));
  return text.data();
}

Error tooSlow(const std::string& who, const std::string& samples, double measured_hz, const Shortfall& most,
              const std::string& where) {
  const double speed = most.step->touch.retract_speed_mm_s;
  const double slower = std::floor(10 * speed * measured_hz / most.needed_hz) / 10;
  std::array<char, 320> text{};
  const int size = std::snprintf(text.data(), text.size(), "%s delivers %s %s a second, and a %s at %g mm/s needs %.0f",
                                 who.c_str(), inWords(measured_hz).c_str(), samples.c_str(),
                                 most.step->kind == Kind::scan ? "scan" : "touch", speed, std::ceil(most.needed_hz));
  std::string all{text.data(), static_cast<std::size_t>(size)};
  all += ": ";
  if (slower >= kSlowest_mm_s) {
    std::snprintf(text.data(), text.size(), "move at %g mm/s or less (--speed), or ", slower);
    all += text.data();
  }
  return Error{all + "let it deliver more (" + where + ")."};
}

}  // namespace

NeededRates neededRates(const Step& step, const Facts& facts) {
  const double speed = step.touch.retract_speed_mm_s;
  if (step.kind == Kind::scan) return ofScan(step, facts);
  if (step.kind != Kind::touch && step.kind != Kind::in_out) return {};
  if (step.touch.by_edges)
    return {.positions_hz = 2 * metrology::kFewestAtAnEdge * speed / (2 * metrology::kWayAtAnEdge_mm)};
  if (step.kind == Kind::touch) return ofTouch(step);
  const double hz = kOnAWay * speed / (kShareOfWay * step.overtravel_mm);
  return {hz, hz};
}

std::optional<Error> whyTooSlow(const Plan& plan, const Facts& facts, const Rates& measured) {
  Shortfall positions, deflections;
  bool reads_probe = false;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    const Step& step = plan.steps[i];
    const NeededRates needed = neededRates(step, facts);
    reads_probe = reads_probe || readsProbe(step);
    if (needed.positions_hz > positions.needed_hz) positions = {&step, needed.positions_hz};
    if (needed.deflections_hz > deflections.needed_hz) deflections = {&step, needed.deflections_hz};
  }
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const std::string name{"XYZ"[axis]};
    const double hz = measured.positions_hz[axis];
    if (hz == 0) return nothingArrives("positions of axis " + name, "its encoder in box.toml");
    if (hz < kOfAMeasurement * positions.needed_hz)
      return tooSlow("The encoder of " + name, "positions", hz, positions, "rate_hz of its encoder in box.toml");
  }
  if (!reads_probe) return std::nullopt;
  if (measured.deflections_hz == 0) return nothingArrives("deflections of the probe", "[devices] probe in box.toml");
  if (measured.deflections_hz < kOfAMeasurement * deflections.needed_hz)
    return tooSlow("The probe", "deflections", measured.deflections_hz, deflections, "rate_hz in probe.toml");
  return std::nullopt;
}

}  // namespace probebox::procedure
