#include "firmware/metrology/machine/check_run.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/machine/sphere_form.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/whole_record.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSameDirection = 0.9998;  // cosine: one degree
constexpr double kClosed = 0.5;            // of the square of half of the run: weakest spread in time of repeats
constexpr double kClosedInMiddle = 0.2;    // of its fourth power, what a line in time leaves of them

Index directionOf(std::vector<Vector3d>& directions, const Vector3d& normal) {
  const auto found =
      std::ranges::find_if(directions, [&](const auto& one) { return one.dot(normal) > kSameDirection; });
  if (found != directions.end()) return found - directions.begin();
  directions.push_back(normal);
  return std::ssize(directions) - 1;
}

Refusal notClosed() {
  return {"not-closed",
          "the first touches are not repeated at the end of the run along X, Y and Z, so drift looks like form: touch "
          "+X, -X, +Y, -Y and +Z first, in the middle and last"};
}

// Spread in time of the touches of each direction, along the axes; of its square, less what a line explains of it.
std::pair<double, double> spreadOfRepeats(const CheckRun& run) {
  Matrix3d straight = Matrix3d::Zero(), curved = Matrix3d::Zero();
  for (Index d = 0; d < run.driftAt(); ++d) {
    VectorXd t{run.count()};
    Index n = 0;
    for (const auto& one : run.touches)
      if (one.direction == d) t[n++] = one.minutes;
    // A drift that a minute tells need not be that of the run.
    if (n < 2 || t.head(n).maxCoeff() - t.head(n).minCoeff() < run.half_min) continue;
    const VectorXd line = t.head(n).array() - t.head(n).mean();
    VectorXd square = line.cwiseAbs2();
    square.array() -= square.mean();
    const double squares = line.squaredNorm();
    if (squares > 0) square -= square.dot(line) / squares * line;
    const Vector3d& u = run.directions[static_cast<std::size_t>(d)];
    straight += squares * u * u.transpose();
    curved += square.squaredNorm() * u * u.transpose();
  }
  const double half = run.half_min * run.half_min;
  if (!(half > 0)) return {0, 0};
  return {symmetricEigenvalues(straight)[0] / half, symmetricEigenvalues(curved)[0] / (half * half)};
}

}  // namespace

Outcome<CheckRun, Refusal> readCheckRun(const Dataset& dataset) {
  TRY(const auto listed, checkedTable(dataset, "touches", kTouchesColumns));
  const auto [slowest, fastest] = std::ranges::minmax(*listed->column(column::kSpeed));
  if (slowest > 0.0) {
    if (auto refusal = refuseSpeeds(slowest, fastest)) return *refusal;
  }
  CheckRun run;
  TRY(run.recorded, readTouches(dataset));
  TRY(auto whole, fitWholeRecord(run.recorded, {.carried = MatrixXd::Ones(std::ssize(run.recorded), 1)}));
  if (whole.centre.size() != 3) return Refusal{"few-directions", "the touches lie in one plane: touch the top as well"};
  run.about = whole.centre;
  run.noise_dof = whole.noise_dof;
  // Lost motion is an answer here.
  std::ranges::copy_if(whole.warnings, std::back_inserter(run.warnings),
                       [](const std::string& warning) { return !warning.starts_with("lost-motion"); });
  std::vector<double> times;
  for (std::size_t i = 0; i < run.recorded.size(); ++i) {
    const TouchPlan& plan = run.recorded[i].plan;
    if (!std::isfinite(whole.worst[i])) {
      run.dropped.push_back({plan.name, "not read"});
      continue;
    }
    WholeTouch& touch = *std::ranges::find(whole.touches, plan.name,
                                           [](const WholeTouch& one) -> const std::string& { return one.plan.name; });
    const Vector3d arm = touch.surface - run.about;
    CheckTouch one{.touch = touch,
                   .recorded = i,
                   .direction = directionOf(run.directions, plan.normal),
                   .normal = arm.normalized(),
                   .distance_mm = arm.norm()};
    one.speed_mm_s = touch.has_way_in ? 0.5 * (touch.speed_in_mm_s + touch.speed_out_mm_s) : touch.speed_out_mm_s;
    one.depth_mm = run.recorded[i].probe.values.rowwise().norm().maxCoeff() / touch.values[2];
    const auto& stamps = run.recorded[i].machine.times;
    times.push_back(0.5 * (stamps.front() + stamps.back()));
    run.touches.push_back(std::move(one));
  }
  if (auto refusal = refuseDirections(run.directions)) return *refusal;
  const auto [first, last] = std::ranges::minmax(times);
  run.half_min = (last - first) / 120.0;
  for (std::size_t i = 0; i < times.size(); ++i) run.touches[i].minutes = (times[i] - 0.5 * (first + last)) / 60.0;
  const auto [straight, curved] = spreadOfRepeats(run);
  if (straight < kClosed) return notClosed();
  run.curved = curved > kClosedInMiddle;
  return run;
}

}  // namespace probebox::metrology
