#include "firmware/procedure/dataset/rim_readings.hpp"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 4> kReadingsColumns{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 3> kStylusColumns{"A_rad", "x_mm", "y_mm"};
// The steps need the same angle twice: what a machine reads beside it by less is that angle.
constexpr double kSameAngle_rad = 1e-5;

double angleOf(const Reading& reading, double c_on_line_rad) {
  const double c_rad = c_on_line_rad - reading.c_rad - reading.rim.zero_rad;
  return std::abs(c_rad - reading.rim.c_rad) < kSameAngle_rad ? reading.rim.c_rad : c_rad;
}

// The loops of which there are touches.
RimLoops loopsOf(const capture::Recording& recording) {
  RimLoops loops{.count = 0};
  for (const auto& touch : recording.touches()) {
    const auto& [loop, zero_rad, c_rad] = touch.request.rim;
    if (loop == 0 || loop > kMostRimLoops) continue;
    loops.count = loop;
    loops.zeros_rad[loop - 1U] = zero_rad;
    loops.closes = c_rad == 0;
  }
  return loops;
}

}  // namespace

void addRimSteps(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts) {
  const RimBall ball = facts.rim_ball.value_or(RimBall{});
  auto table = metrology::Table::withColumns("readings", kReadingsColumns);
  auto stylus = metrology::Table::withColumns("stylus", kStylusColumns);
  for (const auto& reading : readings) {
    const auto& at = reading.centre.centre_mm;
    if (reading.rim.loop == 0) {
      stylus.append({halfTurns_deg(reading.a_rad) * std::numbers::pi / 180, at.x(), at.y()});
    } else {
      table.append({static_cast<double>(reading.rim.loop), angleOf(reading, ball.c_on_line_rad), at.x(), at.y()});
    }
  }
  dataset.config["sigma_mm"] = sigmaOf(readings);
  dataset.config["sigma_C_rad"] = facts.sigma_c_rad;
  if (ball.level_limit_mm) dataset.config["level_limit_mm"] = *ball.level_limit_mm;
  dataset.tables.insert(dataset.tables.begin(), {std::move(table), std::move(stylus)});
}

std::optional<RimLoops> nextLoops(Method method, const capture::Recording& recording, const RunDataset& measured) {
  if (method != Method::centreline_by_steps || measured.refusal) return std::nullopt;
  RimLoops loops = loopsOf(recording);
  const auto* table = measured.dataset.table("readings");
  if (loops.closes || table == nullptr || table->rows() < 2) return std::nullopt;
  const auto row = [&](std::size_t k) {
    return Eigen::Vector2d{table->column("x_mm")->at(k), table->column("y_mm")->at(k)};
  };
  const Eigen::Vector2d plus = row(table->rows() - 2), minus = row(table->rows() - 1);
  const auto stated = measured.dataset.config.find("level_limit_mm");
  const double limit_mm =
      stated == measured.dataset.config.end() ? metrology::kUsualLevelLimit_mm : std::get<double>(stated->second);
  if (std::abs(plus.y() - minus.y()) < limit_mm || loops.count == kMostRimLoops) {
    loops.closes = true;
    return loops;
  }
  loops.zeros_rad[loops.count] = loops.zeros_rad[loops.count - 1] + metrology::remainingShift(plus, minus);
  ++loops.count;
  return loops;
}

}  // namespace probebox::procedure
