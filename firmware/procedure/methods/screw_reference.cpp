#include "firmware/metrology/screw/screw_reference.hpp"

#include <array>
#include <string>
#include <utility>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/sweep.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

constexpr double kRest_s = 60;
constexpr double kRest_mm_s = 1;  // stated in markers, though nothing moves

constexpr Fact kScrewAndFace{
    .place = "`[screw.X]`", .known = nullptr, .missing = {}};  // restOptions() and whyNoFace() check it
constexpr std::array kNeedsOfScrewReference{&kScrewAndFace};

// Completes nothing: a rest has no options beside its axis.
Outcome<ProcedureOptions> restOptions(ProcedureOptions options, const Facts& facts) {
  const std::string method{kScrewReference.name()};
  if (options.axis < 1 || options.axis > kLinearAxes)
    return Error{method + " reads one screw: name its axis, X, Y or Z (--axis X)."};
  if (options.speed_count != 0) return Error{method + " stands still and takes no speeds: omit that option."};
  const std::string axis{"XYZ"[options.axis - 1U]};
  const auto& screw = facts.screws[options.axis - 1U];
  if (!screw) {
    return Error{"The screw of " + axis + " is not described: give [screw." + axis +
                 "] in machine.toml, or choose an axis that has a sensor on its screw."};
  }
  return options;
}

// The table is measured: it may come into force later.
std::optional<NotReady> whyNoFace(const ProcedureOptions& options, const Facts& facts) {
  if (options.axis < 1 || options.axis > kLinearAxes) return std::nullopt;  // restOptions() says so
  const auto& screw = facts.screws[options.axis - 1U];
  if (!screw || screw->face) return std::nullopt;
  const std::string axis{"XYZ"[options.axis - 1U]};
  return NotReady{Obstacle::state, std::string{kScrewReference.name()} + " needs the face table of the screw of " +
                                       axis +
                                       ", because one angle does not show the mean of its face, and none is in force: "
                                       "calibrate it first (probebox calibrate screw-calibration --axis " +
                                       axis + ") and accept it."};
}

std::optional<Error> whyNoRest(const ProcedureOptions& options) {
  return outside("An axis", options.axis, 1, kLinearAxes, "(X, Y, Z)");
}

void addRest(Plan& plan, const ProcedureOptions& options) {
  std::array<double, 3> direction{};
  direction.at(options.axis - 1U) = 1;
  const capture::TouchRequest rest{.outward_normal = direction,
                                   .retract_direction = direction,
                                   .retract_speed_mm_s = kRest_mm_s,
                                   .sweeps = true,
                                   .rest_s = kRest_s};
  add(plan, {.touch = rest, .kind = Kind::rest});
}

constexpr OwnSteps kRest{.why_refused = whyNoRest, .fill = addRest};

void addFace(metrology::Dataset& dataset, const ScrewFace& face) {
  auto table = metrology::emptyTable(metrology::kScrewReference, "sector_table");
  for (std::size_t i = 0; i < face.sector_um.size(); ++i) table.append({static_cast<double>(i), face.sector_um[i]});
  if (face.sd_um > 0) dataset.config["sd_T_um"] = face.sd_um;
  dataset.config["screw_result"] = static_cast<double>(face.result_id);
  dataset.tables.push_back(std::move(table));
}

RunDataset restDataset(const FinishedRun& of) {
  RunDataset run{{.method = std::string{of.method.name()}, .config = {}, .tables = {}}, {}, {}};
  auto readings = metrology::emptyTable(metrology::kScrewReference, "at_rest");
  const auto& rest = of.recording.touches().back();
  const std::size_t axis = axisAlong(rest.request.outward_normal);
  run.dataset.config["axis"] = std::string{"XYZ"[axis]};
  const auto unplaced = appendScrewReadings(of, rest, readings);
  if (auto warning = unplacedReadings(unplaced, unplaced + readings.rows()))
    run.warnings.push_back(*std::move(warning));
  run.dataset.tables.push_back(std::move(readings));
  if (const auto& face = of.facts.screws[axis]->face) addFace(run.dataset, *face);
  return run;
}

}  // namespace

constinit const LiveMethod kScrewReference{
    .number = 25,
    .solver = &metrology::kScrewReference,
    .steps = "one rest of 60 s with the screw of one axis (`--axis`) cold, wherever the axis stands; no touches",
    .needs = kNeedsOfScrewReference,
    .kind = Kind::rest,
    .takes_axis = true,
    .of_screw = true,
    .own_steps = &kRest,
    .described = restOptions,
    .why_unfit = whyNoFace,
    .why_not_now = [](const ProcedureOptions& options, const MachineNow& now,
                      const Facts&) { return whyScrewUnread(options.axis, now); },
    .dataset = restDataset};

}  // namespace probebox::procedure
