#include "firmware/metrology/selftest/selftest.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <span>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kMoved{.key = "moved_mm", .about = "one row per step, x y z"};
constexpr Quantity kDeflected{.key = "deflected_mm", .about = "one row per step, x y z"};

using Eigen::Vector3d;

constexpr double kFewestMoved_mm = 0.5;  // less is an axis that stood, or one without an encoder
constexpr double kScale = 0.02;
constexpr double kOthers_mm = 0.2;
constexpr double kDeflected_mm = 0.05;
constexpr double kAside_rad = std::numbers::pi / 6;
constexpr double kUsualDigit = 0.01;  // of a control (chosen), where the numbers may be rounder by chance
constexpr double kFree = 0.5;         // of the deflection: its ends differ by less when the stylus is free at both
// Shares of the rows of a step: at rest after a jog, and with the stylus fully deflected.
constexpr double kAfter = 0.05;
constexpr double kDeepest = 0.02;

constexpr const char* kAxes = "XYZ";

// Motion and deflection of a step, in machine axes.
struct Step {
  double number{};
  Vector3d towards;
  double travel_mm{};  // 0: a push
  Vector3d moved_mm, moved_sd_mm;
  Vector3d deflected_mm, deflected_sd_mm;
  Vector3d left_mm;  // deflection at its end less that at its beginning
};

using Columns = std::span<const MethodColumn, 3>;
constexpr Columns kPositions{column::kPosition}, kChannels{column::kChannels};

// The place to which each column is given; one that never changes, and shows no digits, has those of the others.
// Positions are commanded, so round ones say nothing of places above the usual.
Vector3d digitsOf(const Table& table, Columns columns) {
  const bool commanded = columns[0].role == ColumnRole::coordinate;
  std::array<ShownDigit, 3> shown;
  double finest = kUsualDigit;
  for (std::size_t k = 0; k < 3; ++k) {
    shown[k] = shownDigit(*table.column(columns[k]), kUsualDigit);
    finest = std::min(finest, shown[k].digit);
  }
  Vector3d digits;
  for (std::size_t k = 0; k < 3; ++k) {
    const bool sure = !commanded && shown[k].chance < kCoarseByChance;
    const double most = sure ? shown[k].digit : kUsualDigit;
    digits[static_cast<Eigen::Index>(k)] = shown[k].constant ? finest : std::min(shown[k].digit, most);
  }
  return digits;
}

struct Rows {
  Vector3d digits;
  std::vector<Vector3d> values;

  std::size_t share(double of_all) const {
    const auto wanted = static_cast<std::size_t>(of_all * static_cast<double>(values.size()));
    return std::max(wanted, kSelftestEndRows);
  }
  struct Mean {
    Vector3d value, sd;
  };
  // What rounding leaves of a mean does not show in the scatter.
  Mean meanOf(std::span<const Vector3d> some) const {
    const auto count = static_cast<double>(some.size());
    Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
    for (const auto& value : some) sum += value;
    const Vector3d mean = sum / count;
    for (const auto& value : some) squares += (value - mean).cwiseAbs2();
    const Vector3d scatter = (squares / std::max(1.0, count - 1)).cwiseSqrt();
    Vector3d sd;
    for (Eigen::Index k = 0; k < 3; ++k)
      sd[k] = std::hypot(scatter[k] / std::sqrt(count), roundingSd(scatter[k], digits[k]));
    return {mean, sd};
  }
  Mean before() const { return meanOf(std::span{values}.first(kSelftestEndRows)); }
  Mean after() const { return meanOf(std::span{values}.last(share(kAfter))); }
  Mean last() const { return meanOf(std::span{values}.last(kSelftestEndRows)); }
  // Where the stylus was deflected most, but for the few rows beyond: no wild sample decides.
  Mean deepest() const {
    std::vector<Vector3d> sorted = values;
    const Vector3d rest = before().value;
    std::ranges::sort(sorted, std::greater{}, [&](const Vector3d& value) { return (value - rest).norm(); });
    const std::size_t some = share(kDeepest);
    return meanOf(std::span{sorted}.subspan(std::min(some, sorted.size() - some), some));
  }
};

Rows rowsOf(const Table& table, double touch, Columns columns, const Vector3d& digits) {
  Rows rows{digits, {}};
  const auto& numbers = *table.column(column::kTouch);
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (numbers[i] != touch) continue;
    rows.values.emplace_back((*table.column(columns[0]))[i], (*table.column(columns[1]))[i],
                             (*table.column(columns[2]))[i]);
  }
  return rows;
}

Outcome<Eigen::Matrix3d, Refusal> gainOf(const Dataset& dataset) {
  if (dataset.config.contains("gain")) return configGain(dataset, "gain");
  return Refusal{"bad-config", "gain is needed: give the probe's matrix, three rows of three numbers"};
}

Outcome<std::vector<Step>, Refusal> stepsOf(const Dataset& dataset) {
  if (auto refusal = refuseTurnedProbe(dataset)) return *refusal;
  TRY(const auto machine, checkedTable(dataset, "machine", kMachineColumns));
  TRY(const auto probe, checkedTable(dataset, "probe", kProbeColumns));
  TRY(const auto touches, checkedTable(dataset, "touches", kTouchesColumns));
  TRY(const auto kinds, checkedTable(dataset, "steps", kSelftestColumns));
  TRY(const auto gain, gainOf(dataset));
  const Vector3d of_positions = digitsOf(*machine, kPositions), of_channels = digitsOf(*probe, kChannels);
  std::vector<Step> steps;
  const auto& normal_of = *touches;
  for (std::size_t i = 0; i < normal_of.rows(); ++i) {
    const double number = (*normal_of.column(column::kTouch))[i];
    const auto& numbers = *kinds->column(column::kTouch);
    const auto kind = std::ranges::find(numbers, number);
    const Rows positions = rowsOf(*machine, number, kPositions, of_positions);
    const Rows channels = rowsOf(*probe, number, kChannels, of_channels);
    if (kind == numbers.end() || positions.values.size() < kSelftestEndRows ||
        channels.values.size() < kSelftestEndRows)
      return Refusal{"incomplete-step", "step " + text(number) + " has no row in steps, or fewer than 5 rows in " +
                                            "machine or probe: record it again"};
    const auto from = positions.before(), to = positions.after();
    const auto rest = channels.before(), deep = channels.deepest(), end = channels.last();
    steps.push_back(
        {.number = number,
         .towards = {(*normal_of.column(column::kNormalX))[i], (*normal_of.column(column::kNormalY))[i],
                     (*normal_of.column(column::kNormalZ))[i]},
         .travel_mm = (*kinds->column(kSelftestColumns[1]))[static_cast<std::size_t>(kind - numbers.begin())],
         .moved_mm = to.value - from.value,
         .moved_sd_mm = (from.sd.cwiseAbs2() + to.sd.cwiseAbs2()).cwiseSqrt(),
         .deflected_mm = gain * (deep.value - rest.value),
         .deflected_sd_mm = (gain.cwiseAbs2() * (deep.sd.cwiseAbs2() + rest.sd.cwiseAbs2())).cwiseSqrt(),
         .left_mm = gain * (end.value - rest.value)});
  }
  return steps;
}

std::string printed(const char* format, auto... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

Eigen::Index largest(const Vector3d& vector) {
  Eigen::Index at = 0;
  vector.cwiseAbs().maxCoeff(&at);
  return at;
}

Finding judgeJog(const Step& step) {
  const Eigen::Index axis = largest(step.towards);
  const Eigen::Index moved = largest(step.moved_mm);
  const double by_mm = step.moved_mm[axis] * (step.towards[axis] < 0 ? -1 : 1);
  const double travel_mm = step.travel_mm;
  const char name = kAxes[axis], other = kAxes[moved];
  if (step.moved_mm.cwiseAbs().maxCoeff() < kFewestMoved_mm)
    return {false, "axis-stood",
            printed("%c should have moved by %g mm, and no encoder counted: check the encoder's cable and input of %c, "
                    "or jog it again.",
                    name, travel_mm, name)};
  if (moved != axis)
    return {false, "axes-exchanged",
            printed("%c should have moved, but %c counted %+.3f mm: the encoder inputs of %c and %c are exchanged, or "
                    "the other axis was jogged.",
                    name, other, step.moved_mm[moved], name, other)};
  if (by_mm < 0)
    return {false, "sense-wrong",
            printed("%c moved in + by %g mm, but its counts give %+.3f mm: change the sign of sense in [axis.%c] of "
                    "machine.toml.",
                    name, travel_mm, by_mm, name)};
  Vector3d others = step.moved_mm;
  others[axis] = 0;
  if (others.cwiseAbs().maxCoeff() > kOthers_mm)
    return {false, "not-alone",
            printed("%c should have moved alone, but %c moved %+.3f mm as well: jog one axis only.", name,
                    kAxes[largest(others)], others[largest(others)])};
  if (std::abs(by_mm / travel_mm - 1) > kScale)
    return {false, "scale-wrong",
            printed("%c moved by %g mm, but its counts give %.3f mm: multiply counts_per_mm in [axis.%c] of "
                    "machine.toml by %.6g, or jog by exactly %g mm.",
                    name, travel_mm, by_mm, name, by_mm / travel_mm, travel_mm)};
  return {true, "", printed("%c counts up as it moves up: %+.3f mm of %g mm.", name, by_mm, travel_mm)};
}

Finding judgePush(const Step& step) {
  const Eigen::Index axis = largest(step.towards);
  const char name = kAxes[axis];
  const char sign = step.towards[axis] < 0 ? '-' : '+';
  const double depth_mm = step.deflected_mm.norm();
  if (depth_mm < kDeflected_mm)
    return {false, "not-deflected",
            printed("The stylus should have been pushed towards %c%c, but the probe measured %.3f mm: check its cable "
                    "and its receiver, or push it further.",
                    sign, name, depth_mm)};
  // The sign of such a push would be a guess.
  if (step.left_mm.norm() > kFree * depth_mm)
    return {
        false, "not-free",
        printed("The stylus was to be pushed towards %c%c and released, but its deflections at the beginning and at "
                "the end of the step differ by %.3f mm: begin the step with the stylus free, and release it before "
                "the end.",
                sign, name, step.left_mm.norm())};
  const Vector3d direction = step.deflected_mm / depth_mm;
  const double along = std::clamp(direction.dot(step.towards.normalized()), -1.0, 1.0);
  const double aside_rad = std::acos(along);
  const auto seen =
      printed("(%+.3f, %+.3f, %+.3f) mm", step.deflected_mm[0], step.deflected_mm[1], step.deflected_mm[2]);
  if (aside_rad <= kAside_rad)
    return {true, "", printed("The probe measures a push towards %c%c as %s.", sign, name, seen.c_str())};
  if (std::numbers::pi - aside_rad <= kAside_rad)
    return {
        false, "probe-sign-wrong",
        printed("The stylus was pushed towards %c%c, but the probe measured %s: see that A stands at 0, or change the "
                "signs in row %c of gain in probe.toml.",
                sign, name, seen.c_str(), name)};
  return {
      false, "probe-direction-wrong",
      printed("The stylus was pushed towards %c%c, but the probe measured %s: see that A stands at 0, push it again, "
              "straight, or put the rows of gain in probe.toml in the order X Y Z of the machine.",
              sign, name, seen.c_str())};
}

}  // namespace

Outcome<std::vector<Finding>, Refusal> selftestFindings(const Dataset& dataset) {
  TRY(const auto steps, stepsOf(dataset));
  std::vector<Finding> findings;
  for (const Step& step : steps) findings.push_back(step.travel_mm != 0 ? judgeJog(step) : judgePush(step));
  return findings;
}

Outcome<Result, Refusal> solveSelftest(const Dataset& dataset) {
  TRY(const auto steps, stepsOf(dataset));
  const auto findings = selftestFindings(dataset);
  std::optional<Refusal> refusal;
  for (const Finding& finding : *findings) {
    if (finding.good) continue;
    if (!refusal) refusal = Refusal{finding.name, ""};
    refusal->reason += (refusal->reason.empty() ? "" : " ") + finding.what;
  }
  if (refusal) return *refusal;
  Result result;
  result.method = dataset.method;
  std::vector<double> moved, moved_sd, deflected, deflected_sd;
  const auto append = [](std::vector<double>& to, const Vector3d& row) { to.insert(to.end(), row.begin(), row.end()); };
  for (const Step& step : steps) {
    append(moved, step.moved_mm);
    append(moved_sd, step.moved_sd_mm);
    append(deflected, step.deflected_mm);
    append(deflected_sd, step.deflected_sd_mm);
  }
  result.estimates.push_back(Estimate::matrix(kMoved, 3, std::move(moved), std::move(moved_sd)));
  result.estimates.push_back(Estimate::matrix(kDeflected, 3, std::move(deflected), std::move(deflected_sd)));
  result.convention =
      "one row per step, columns X Y Z of the machine; deflection of the stylus ball relative to the probe body";
  return result;
}

namespace {

constexpr MethodTable kTables[]{{"machine", kMachineColumns, "position of the moving reference at its stamp"},
                                {"probe", kProbeColumns, "raw deflection at its stamp", true},
                                {"touches", kTouchesColumns, "a step: normal n along which it moves or is pushed"},
                                {"steps", kSelftestColumns, "a step: travel of its jog, 0 of a push"}};
constexpr MethodKey kKeys[]{
    {"gain", kNeeded, "3 x 3, the probe's matrix as it is described (A3)"}, kProbeAtZero, kProbeB};
constexpr Quantity kResults[]{kMoved, kDeflected};
constexpr std::string_view kUnobservable[]{
    "errors below its limits, 2 % of a travel and 30 degrees of a push: calibrations find these"};

}  // namespace

const Method kSelftest{.name = "selftest",
                       .title = "First look at a machine and its probe",
                       .equations = "(A3)",
                       .source = "none; the gain matrix is that of CN101622513",
                       .solver = solveSelftest,
                       .tables = kTables,
                       .keys = kKeys,
                       .results = kResults,
                       .unobservable = kUnobservable};

}  // namespace probebox::metrology
