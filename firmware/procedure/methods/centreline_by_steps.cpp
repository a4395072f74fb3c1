#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/rim_contacts.hpp"
#include "firmware/procedure/dataset/stop_shifts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/rim_loops.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/turns.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

// Measured angle of C, clockwise from the zero of the loop.
double angleOf(const Reading& reading, double c_on_line_rad) {
  const RimStep rim = rimStep(reading.note);
  return rim.c_rad + std::remainder(c_on_line_rad - reading.c_rad - rim.zero_rad - rim.c_rad, kTurn);
}

// The loops of which there are touches.
RimLoops loopsOf(const capture::Recording& recording) {
  RimLoops loops{.count = 0, .contacted = !recording.contacts().empty()};
  for (const auto& touch : recording.touches()) {
    const auto [loop, zero_rad, c_rad] = rimStep(touch.request.note);
    if (loop == 0 || loop > kMostRimLoops) continue;
    loops.count = loop;
    loops.zeros_rad[loop - 1U] = zero_rad;
    loops.closes = c_rad == 0;
  }
  return loops;
}

// Tables readings and stylus, and the keys.
void addRimSteps(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  const RimBall ball = run.facts.rim_ball.value_or(RimBall{});
  auto table = metrology::emptyTable(metrology::kCentrelineBySteps, "readings");
  auto stylus = metrology::emptyTable(metrology::kCentrelineBySteps, "stylus");
  for (const auto& reading : found.readings) {
    const auto& at = reading.centre.centre_mm;
    const RimStep rim = rimStep(reading.note);
    if (rim.loop == 0) {
      stylus.append({radians(halfTurns_deg(reading.a_rad)), at.x(), at.y()});
    } else {
      table.append({static_cast<double>(rim.loop), angleOf(reading, ball.c_on_line_rad), at.x(), at.y()});
    }
  }
  dataset.config["sigma_mm"] = sigmaOf(found.readings);
  addMeanHeight(dataset, found.readings);
  dataset.config["sigma_C_rad"] = run.facts.sigma_c_rad;
  if (ball.level_limit_mm) dataset.config["level_limit_mm"] = *ball.level_limit_mm;
  dataset.tables.insert(dataset.tables.begin(), {std::move(table), std::move(stylus)});
}

// Adds the contacts of (B25).
std::optional<metrology::Refusal> addContacts(metrology::Dataset& dataset, const FinishedRun& run) {
  TRY(const auto contacts, rimContacts(run));
  auto table = metrology::emptyTable(metrology::kCentrelineBySteps, "contacts");
  table.append({contacts.clockwise_rad, contacts.anticlockwise_rad});
  dataset.config["sigma_contact_rad"] = contacts.sd_rad;
  dataset.tables.push_back(std::move(table));
  if (run.recording.touches().empty()) return std::nullopt;
  for (const auto& [axis, stylus_mm] : movedByStops(run, contacts.stylus_mm, contacts.tool)) {
    auto shift = metrology::Table::withColumns("contacts" + std::string{axis.suffix}, metrology::column::kContacts);
    shift.append(
        {contacts.clockwise_per_mm * stylus_mm.head<2>(), contacts.anticlockwise_per_mm * stylus_mm.head<2>()});
    dataset.tables.push_back(std::move(shift));
  }
  return std::nullopt;
}

// Contacts come before any touch, and are a case of their own until there are touches.
RunDataset rimDataset(const FinishedRun& run) {
  const bool touched = !run.recording.touches().empty();
  RunDataset built = touched
                         ? ballDataset(run, addRimSteps)
                         : RunDataset{{.method = std::string{run.method.name()}, .config = {}, .tables = {}}, {}, {}};
  if (run.recording.contacts().empty() || built.refusal) return built;
  built.refusal = addContacts(built.dataset, run);
  return built;
}

Solved answerOf(const RimLoops& loops) {
  return {.run = 0,
          .at = {},
          .loops = static_cast<std::uint8_t>(loops.count),
          .c_zero_rad = loops.zeros_rad[loops.count - 1],
          .closes = loops.closes};
}

// From the zero of C that the contacts show (B25).
std::optional<Solved> firstLoop(const RunDataset& measured) {
  const auto* contacts = measured.dataset.table("contacts");
  if (contacts == nullptr) return std::nullopt;
  const double middle_rad = (contacts->column(metrology::column::kContacts[0])->front() +
                             contacts->column(metrology::column::kContacts[1])->front()) /
                            2;
  return answerOf({.count = 1, .zeros_rad = {middle_rad}, .contacted = true});
}

// A reading at zero when the last loop is level or the loops are used up, else one more loop from the corrected zero
// (B26).
std::optional<Solved> nextLoop(const FinishedRun& run, const RunDataset& measured) {
  RimLoops loops = loopsOf(run.recording);
  if (loops.contacted && loops.count == 0) return firstLoop(measured);
  const auto* table = measured.dataset.table("readings");
  if (loops.closes || table == nullptr || table->rows() < 2) return std::nullopt;
  const auto row = [&](std::size_t k) {
    return metrology::RimReading{.at = {table->column("x_mm")->at(k), table->column("y_mm")->at(k)},
                                 .c = table->column(metrology::column::kCClockwise)->at(k)};
  };
  const std::array both{row(table->rows() - 2), row(table->rows() - 1)};
  const auto steps = metrology::rimStepsOf(both);
  if (!steps) return std::nullopt;
  const auto stated = measured.dataset.config.find("level_limit_mm");
  const double limit_mm =
      stated == measured.dataset.config.end() ? metrology::kUsualLevelLimit_mm : std::get<double>(stated->second);
  if (std::abs(steps->plus.y() - steps->minus.y()) < limit_mm || loops.count == kMostRimLoops) {
    loops.closes = true;
    return answerOf(loops);
  }
  loops.zeros_rad[loops.count] =
      loops.zeros_rad[loops.count - 1] + metrology::remainingShift(steps->plus, steps->minus);
  ++loops.count;
  return answerOf(loops);
}

std::optional<LoopState> after(const LoopState& state, const ProcedureOptions& options, const Solved& solved) {
  RimLoops loops = rimLoops(state);
  if (options.contact_beside_mm > 0 && !loops.contacted) {
    if (solved.loops != 1 || solved.closes) return std::nullopt;
    loops.zeros_rad[0] = solved.c_zero_rad;
    loops.contacted = true;
    return stateOf(loops);
  }
  const bool next = solved.loops == loops.count + 1 && !solved.closes,
             same = solved.loops == loops.count && solved.closes;
  if (loops.closes || !(next || same) || solved.loops > kMostRimLoops) return std::nullopt;
  loops.count = solved.loops;
  loops.zeros_rad[loops.count - 1] = solved.c_zero_rad;
  loops.closes = solved.closes;
  return stateOf(loops);
}

// Step 1 finds the offset of the stylus; then every loop has +theta and -theta from its zero, and the last one zero
// too.
Pose poseAt(const ProcedureOptions& options, const LoopState& state, std::size_t index) {
  const RimLoops loops = rimLoops(state);
  if (index < 2) return {{index == 0 ? 0.0 : kHalfTurn_rad, 0, options.c_on_line_rad - loops.zeros_rad[0]}, 1};
  const std::size_t k = index - 2, loop = std::min(k / 2, loops.count - 1);
  const double theta_rad = options.arc_rad / 2, zero_rad = loops.zeros_rad[loop];
  const double c_rad = k / 2 == loops.count ? 0 : k % 2 == 0 ? theta_rad : -theta_rad;
  Pose pose{{0, 0, options.c_on_line_rad - zero_rad - c_rad}, 1};
  pose.note = noteOf({.loop = static_cast<std::uint16_t>(loop + 1), .zero_rad = zero_rad, .c_rad = c_rad});
  return pose;
}

std::size_t poseCount(const ProcedureOptions& options, const LoopState& state) {
  const RimLoops loops = rimLoops(state);
  if (options.contact_beside_mm > 0 && !loops.contacted) return 0;
  return 2 + 2 * loops.count + (loops.closes ? 1 : 0);
}

// Step 2 comes first: what it finds lets the other steps meet the ball.
void addTurns(Plan& plan, const ProcedureOptions& with) {
  if (with.contact_beside_mm == 0) return;
  add(plan, turnBeside(1, with));
  add(plan, turnBeside(-1, with));
}

Outcome<ProcedureOptions> completed(ProcedureOptions options, const Facts& facts) {
  if (facts.rim_ball) options.c_on_line_rad = facts.rim_ball->c_on_line_rad;
  if (!options.contacts) return options;
  const std::string name = std::string{kCentrelineBySteps.name()} + " with contacts needs ";
  if (!facts.rim_ball || !facts.rim_ball->beside_mm || !facts.rim_ball->radius_mm)
    return Error{name +
                 "to know where the stylus stands while C turns: give [rim_ball] beside_mm and radius_mm in "
                 "machine.toml, or omit that option and put the ball to the line by hand."};
  if (!facts.rim_ball->c_has_encoder)
    return Error{name +
                 "the angle of C at the contact, and no encoder tells it: wire the encoder of C to the box, and give "
                 "[rotary_axis.C] angle_from = \"encoder\" in machine.toml, or omit that option."};
  options.contact_beside_mm = *facts.rim_ball->beside_mm;
  options.rim_radius_mm = *facts.rim_ball->radius_mm;
  return options;
}

std::optional<Error> whyNoTurns(const ProcedureOptions& with) {
  if (with.spindle > 1)
    return Error{"centreline-by-steps reads [rim_ball], which the main chuck turns: omit the spindle."};
  if (with.contact_beside_mm == 0) return std::nullopt;
  if (auto error = outside("A radius of the rim", with.rim_radius_mm, 5, 20'000, "mm")) return error;
  return outside("A distance of the stylus from the line", with.contact_beside_mm, 1, 0.8 * with.rim_radius_mm, "mm");
}

constexpr Poses kRimSteps{.count = poseCount, .at = poseAt};

constexpr Fact kRimBall{
    .place = "`[rim_ball]`",
    .known = [](const Facts& facts) { return facts.rim_ball.has_value(); },
    .missing = "the angle of C at which the ball is above the axis, along +Y: give [rim_ball] c_deg in machine.toml."};
constexpr std::array kNeedsOfCentrelineBySteps{&kRimBall};

}  // namespace

constinit const LiveMethod kCentrelineBySteps{
    .number = 23,
    .solver = &metrology::kCentrelineBySteps,
    .why_no_y =
        "finds the ball above the axis, along +Y, and this machine has no Y: centreline-x reads a ball "
        "near the axis, at C half a turn apart.",
    .steps =
        "with `--contacts` first C turned until the ball touches the stylus on either side of the line; then one ball, "
        "A at 0 and 180 degrees with C where the ball is nearly on the line along +Y; then C 40 degrees to either side "
        "of its zero (`--arc` halves), from a new zero as long as the two are not level, five loops at most; at last C "
        "at zero; five touches each",
    .needs = kNeedsOfCentrelineBySteps,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kRimSteps,
    .usual = with(readings(), [](auto& options) { options.arc_rad = kUsualRimArc_rad; }),
    .takes_contacts = true,
    .least_arc_deg = 30,  // (B27)
    .first_steps = addTurns,
    .also_refused = whyNoTurns,
    .described = completed,
    .dataset = rimDataset,
    .loops = {.first = stateOf({}),
              .most = stateOf({.count = kMostRimLoops, .zeros_rad = {}, .closes = true, .contacted = true}),
              .next = nextLoop,
              .after = after}};

}  // namespace probebox::procedure
