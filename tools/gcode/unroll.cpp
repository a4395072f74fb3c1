#include "tools/gcode/unroll.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/place_of.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;

constexpr double kBeside_mm = 1;  // less than from a ball after its touches

// Least distance of a point from the centre of a stylus ball on its way; where the stylus hangs, from a line up from
// there, too. It has one minimum over the way.
double distanceTo(const Vector3d& point, const Vector3d& from, const Vector3d& to, bool hangs) {
  constexpr int kRounds = 60;
  const auto at = [&](double share) {
    Vector3d beside = from + share * (to - from) - point;
    if (hangs) beside.z() = std::max(0.0, beside.z());
    return beside.norm();
  };
  double low = 0, high = 1;
  for (int k = 0; k < kRounds; ++k) {
    const double third = (high - low) / 3;
    if (at(low + third) < at(high - third)) {
      high -= third;
    } else {
      low += third;
    }
  }
  return std::min({at(0), at(1), at(low)});
}

// Where the stylus, the axes and the run are behind the blocks so far.
struct Progress {
  std::optional<Vector3d> at_mm;
  std::array<double, 3> angles_rad{};
  std::size_t step{};

  void take(const Block& block) {
    if (const auto* turn = std::get_if<Turn>(&block)) {
      for (std::size_t axis = 0; axis < angles_rad.size(); ++axis) {
        if (turn->used[axis]) angles_rad[axis] = radians(turn->to_deg[axis]);
      }
    } else if (const auto* mark = std::get_if<Mark>(&block)) {
      step = mark->begin ? mark->step : mark->step + 1;
    } else if (std::holds_alternative<Retract>(block)) {
      at_mm.reset();
    } else if (const auto* move = std::get_if<Move>(&block); move != nullptr && knowsPlace(*move)) {
      at_mm = move->to_mm;
    }
  }
};

Error through(std::size_t ball, const Progress& at) {
  const auto angle = [&](std::size_t axis) {
    return procedure::number(std::round(degrees(at.angles_rad[axis])) + 0.0);
  };
  return Error{"On the way to or from step " + std::to_string(at.step + 1) + ", with B " + angle(1) + " and C " +
               angle(2) + ", the stylus would come to ball " + std::to_string(ball + 1) +
               " of the part: choose other angles (--tilts, --angles, --arc), or balls that stand further apart."};
}

bool touchesBalls(const procedure::Plan& plan) {
  return std::ranges::any_of(std::span{plan.steps}.first(plan.step_count), [](const procedure::Step& step) {
    return step.feature == procedure::Feature::part_ball && step.kind != procedure::Kind::hold;
  });
}

// Refuses, with the remedy, a program whose stylus would come to a ball of the part on its way to another one.
std::optional<Error> whyThroughNeighbour(const procedure::Plan& plan, const Blocks& blocks, const Setting& setting) {
  if (!touchesBalls(plan)) return std::nullopt;
  const double met_mm = (*setting.ball_diameter_mm + *setting.stylus_diameter_mm) / 2;
  Progress at;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    if (move != nullptr && at.at_mm && move->axes == Move::Axes::xyz) {
      const auto& step = plan.steps[std::min(at.step, plan.step_count - 1)];
      const bool tilts = step.b_moves == procedure::BMoves::table;
      for (std::size_t ball = 0; ball < setting.balls_mm.size(); ++ball) {
        const bool own = ball + 1 == step.touch.ball;
        if (own && move->way == Way::measure) continue;
        const Vector3d centre = ballInPose(ball, at.angles_rad, tilts, setting);
        // The own ball is touched from the sides that the plan has chosen; a head that swivels has the stylus aslant.
        const bool hangs = !own && step.b_moves != procedure::BMoves::head;
        const double from_mm = distanceTo(centre, *at.at_mm, move->to_mm, hangs);
        if (from_mm < met_mm + (own ? 0 : kBeside_mm)) return through(ball, at);
      }
    }
    at.take(block);
  }
  return std::nullopt;
}

using Eigen::Vector3d;
using procedure::Kind;
using procedure::Step;

constexpr double kSettle_s = 0.3;  // at rest before a step begins
constexpr double kDwell_s = 0.1;   // at overtravel
// At rest after the retract: longer than all delays and the line together.
constexpr double kAfter_s = 0.3;
constexpr double kHold_s = 1;
// A way of a scan that would end beyond that begins with a new mask (LinuxCNC's lasts 20 s). kStop_s: to come to speed
// and to a stop.
constexpr double kMask_s = 17, kStop_s = 0.5;
constexpr double kSwivel_deg_min = 600;  // of a head under tip control

std::array<double, 3> inDegrees(std::array<double, 3> angles_rad) {
  for (double& angle : angles_rad) angle = degrees(angle);
  return angles_rad;
}

// How far a step presses the probe, beyond where it touches.
double pressedBy(const Step& step) {
  if (step.kind == Kind::scan) return std::max(step.overtravel_mm, std::ranges::max(step.touch.scan.depths_mm));
  return step.kind == Kind::touch || step.kind == Kind::in_out ? step.overtravel_mm : 0;
}

std::optional<Error> whyTooFar(std::size_t index, const Step& step, const Setting& setting) {
  const std::string number = "Step " + std::to_string(index + 1);
  const double feed = step.touch.retract_speed_mm_s * 60;
  if (feed > setting.most_mm_min)
    return Error{number + " measures at " + std::to_string(std::lround(feed)) + " mm/min, above the limit of " +
                 std::to_string(std::lround(setting.most_mm_min)) +
                 ": choose lower speeds (--speed), or a higher limit (--most-feed)."};
  if (pressedBy(step) > setting.deflection_limit_mm)
    return Error{number + " goes " + decimal(pressedBy(step)) +
                 " mm into the surface, and the probe may be deflected " + decimal(setting.deflection_limit_mm) +
                 " mm: choose less --overtravel, or give deflection_limit_mm of probe.toml as --deflection-limit."};
  if (step.feature == procedure::Feature::plates)
    return procedure::whyTooNarrow(*setting.gap_mm, *setting.stylus_diameter_mm, step.clearance_mm);
  if (step.feature == procedure::Feature::cylinder)
    return procedure::whyTooNarrow(*setting.bore_mm, *setting.stylus_diameter_mm, step.clearance_mm);
  return std::nullopt;
}

// True if the program holds the probe for some steps and other tools for others, so that it has to call both.
bool changesProbe(const procedure::Plan& plan) {
  bool probe = false, tool = false;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    (plan.steps[i].touch.tool == 0 ? probe : tool) = true;
  }
  return probe && tool;
}

std::optional<Error> whyNot(const procedure::Plan& plan, const Setting& setting) {
  if (plan.method->loops.next != nullptr)
    return Error{
        "The later steps of " + std::string{plan.method->name()} +
        " follow from what the earlier ones measure, and a program without registers cannot know them: let the control "
        "read its steps from the box (docs/integrator.md)."};
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    if (auto error = whyUnknown(plan.steps[i], setting)) return error;
    if (auto error = whyTooFar(i, plan.steps[i], setting)) return error;
  }
  if (changesProbe(plan) && setting.probe_tool == 0)
    return Error{
        "The program has to know with which tool it takes the probe, since it takes other tools too: give "
        "--probe-tools NUMBER."};
  return std::nullopt;
}

// Refuses a safe height that the way round a feature, or the step itself, goes beyond.
std::optional<Error> whyTooLow(const Step& step, const Place& place, const Setting& setting) {
  const double surface_mm = surfaceOf(step, place, setting).z();
  const double beyond_mm = (step.clearance_mm + step.run_out_mm) * step.touch.retract_direction[2];
  const double top_mm = std::max(place.centre_mm.z() + 1.2 * place.keep_out_mm,
                                 step.kind == Kind::hold ? surface_mm : surface_mm + beyond_mm);
  if (*setting.safe_z_mm > top_mm) return std::nullopt;
  return Error{"--safe-z has to be above " + std::to_string(std::lround(std::ceil(top_mm))) +
               " mm, which the way round a feature or a step of the run reaches: give a larger one."};
}

// Writes the blocks of one run.
class Unroller {
 public:
  Unroller(const procedure::Plan& plan, const Setting& setting) : plan_{plan}, setting_{setting} {
    for (std::size_t i = 0; i < plan.step_count; ++i) {
      const bool reads = !movesOneAxis(plan.steps[i]) && plan.steps[i].kind != Kind::rest;
      used_[0] = used_[0] || (setting.orients && reads);
      if (!plan.steps[i].turns) continue;
      any_turns_ = true;
      const auto angles = inDegrees(plan.steps[i].touch.rotary_angles_rad);
      for (std::size_t axis = 0; axis < 3; ++axis) used_[axis] = used_[axis] || angles[axis] != 0;
    }
  }

  Outcome<Blocks> write() {
    for (index_ = 0; index_ < plan_.step_count; ++index_) {
      const Step& step = plan_.steps[index_];
      if (step.kind == Kind::rest) {
        rest(step);
        continue;
      }
      if (movesOneAxis(step)) {
        alone(step);
        continue;
      }
      const Place place = placeOf(step, setting_);
      if (auto error = whyTooLow(step, place, setting_)) return *error;
      reach(step, place);
      measure(step, place);
    }
    rise();
    if (tip_control_) {
      standUpright();
      retract();
    }
    finish();
    return std::move(blocks_);
  }

 private:
  Feeds feeds() const { return {setting_.traverse_mm_min, setting_.near_mm_min}; }
  void move(const Vector3d& to, double feed_mm_min, Way way) {
    blocks_.push_back(Move{to, feed_mm_min, way});
    here_ = to;
  }

  // Drops blocks that move nothing, and finds the moves that are to meet nothing. The first one after the operator's
  // own has no known begin.
  void finish() {
    constexpr double kNothing_mm = 2e-3;  // still another place when it is written with three decimals
    Blocks moving;
    std::optional<Vector3d> here;
    for (auto& block : blocks_) {
      if (auto* move = std::get_if<Move>(&block)) {
        const bool whole = move->axes == Move::Axes::xyz;
        if (whole && here && (*here - move->to_mm).norm() < kNothing_mm) continue;
        move->free = whole && here && move->way != Way::measure;
        if (whole || move->length) here = move->to_mm;
      } else if (std::holds_alternative<Retract>(block)) {
        here.reset();
      }
      moving.push_back(std::move(block));
    }
    blocks_ = std::move(moving);
  }

  void rise() {
    if (near_) goUp(blocks_, *near_, here_, *setting_.safe_z_mm, feeds());
    near_.reset();
  }

  // To the begin of the step, by way of the safe height where pose, tool or feature is another one.
  void reach(const Step& step, const Place& place) {
    const Vector3d begin = beginOf(step, place);
    const bool as_before = near_ && *near_ == place && !mustChange(step);
    blocks_.push_back(Note{promptFor(plan_, index_)});
    if (as_before) {
      goRound(blocks_, place, here_, begin, feeds());
    } else {
      rise();
      change(step, place.centre_mm);
      goDown(blocks_, place, begin, *setting_.safe_z_mm, feeds());
    }
    near_ = place;
    here_ = begin;
  }

  bool mustChange(const Step& step) const {
    return step.touch.tool != tool_ || step.touch.mount != mount_ ||
           (step.turns && step.touch.rotary_angles_rad != angles_rad_);
  }

  void change(const Step& step, const Vector3d& place_mm) {
    if (!started_ || step.touch.tool != tool_) takeUp(step, place_mm);
    if (step.touch.mount != mount_ && step.touch.mount > 1) {
      const std::string number = std::to_string(step.touch.mount);
      blocks_.push_back(
          plan_.method->clamps_further_out
              ? Stop{"CLAMP THE BALL FURTHER OUT: MOUNT " + number, "MOUNT " + number + ": BALL FURTHER OUT"}
              : Stop{"PUT THE PLATE INTO MOUNT " + number, "MOUNT " + number + ": PUT PLATE IN"});
    }
    mount_ = step.touch.mount;
    if (step.turns && (turns_anew_ || step.touch.rotary_angles_rad != angles_rad_))
      turnTo(step.touch.rotary_angles_rad);
    if (!step.turns && turns_anew_ && used_[0]) orient();
  }

  // Takes the probe or tool of a step, its length offset on the way down to the safe height. Where nothing says with
  // which tool the probe is taken, it is in the spindle.
  void takeUp(const Step& step, const Vector3d& place_mm) {
    const double safe_mm = *setting_.safe_z_mm, feed = setting_.traverse_mm_min;
    const Vector3d above{place_mm.x(), place_mm.y(), safe_mm};
    if (tip_control_) standUpright();
    started_ = turns_anew_ = true;
    tool_ = step.touch.tool;
    const bool swivels = step.b_moves == procedure::BMoves::head;
    const std::uint32_t number = tool_ != 0 ? tool_ : setting_.probe_tool;
    if (number == 0) {
      blocks_.push_back(CheckLength{});
      blocks_.push_back(Move{.to_mm = above, .feed_mm_min = feed, .way = Way::level, .axes = Move::Axes::z});
      return;
    }
    retract();
    blocks_.push_back(TakeTool{number});
    if (swivels) turnTo({});
    blocks_.push_back(Move{.to_mm = above, .feed_mm_min = feed, .way = Way::level, .axes = Move::Axes::xy});
    blocks_.push_back(Move{.to_mm = above,
                           .feed_mm_min = feed,
                           .way = Way::level,
                           .axes = Move::Axes::z,
                           .length = LengthOffset{number, swivels}});
    tip_control_ = swivels;
  }

  void retract() {
    blocks_.push_back(Retract{tip_control_});
    tip_control_ = false;
  }

  // The spindle keeps its orientation until a tool is changed.
  void turnTo(const std::array<double, 3>& angles_rad) {
    auto turned = used_;
    if (!turns_anew_ && angles_rad[0] == angles_rad_[0]) turned[0] = false;
    turns_anew_ = false;
    angles_rad_ = angles_rad;
    const std::optional<double> feed_deg_min = tip_control_ ? std::optional{kSwivel_deg_min} : std::nullopt;
    if (turned != std::array<bool, 3>{}) blocks_.push_back(Turn{inDegrees(angles_rad_), turned, feed_deg_min});
  }

  // Else it would be chance how the stylus is turned.
  void orient() {
    turns_anew_ = any_turns_;
    blocks_.push_back(Turn{.to_deg = {}, .used = {true, false, false}});
  }

  // Without tip control, coordinates are of the tip only there.
  void standUpright() {
    if (angles_rad_[1] != 0 || angles_rad_[2] != 0) turnTo({angles_rad_[0], 0, 0});
  }

  Vector3d beginOf(const Step& step, const Place& place) const {
    const Vector3d surface = surfaceOf(step, place, setting_);
    if (step.kind == Kind::hold) return surface;
    return surface + step.clearance_mm * vectorOf(step.touch.retract_direction);
  }

  void mark(bool begin, const Step& step) {
    blocks_.push_back(Mark{begin, index_, inDegrees(angles_rad_), tool_, step.touch.retract_speed_mm_s});
  }

  void measure(const Step& step, const Place& place) {
    if (step.kind == Kind::scan) return scan(step, place);
    if (seeks(step)) seek(step, place);
    blocks_.push_back(Wait{kSettle_s});
    mark(true, step);
    if (step.kind == Kind::hold) {
      blocks_.push_back(Wait{kHold_s});
    } else {
      const Vector3d surface = surfaceOf(step, place, setting_), retract = vectorOf(step.touch.retract_direction);
      const double feed = step.touch.retract_speed_mm_s * 60;
      blocks_.push_back(Contact{true});
      press(surface - step.overtravel_mm * retract, feed, step);
      if (step.kind == Kind::touch) blocks_.push_back(Wait{kDwell_s});
      press(surface + (step.clearance_mm + step.run_out_mm) * retract, feed, step);
      blocks_.push_back(Contact{false});
      blocks_.push_back(Wait{kAfter_s});
    }
    mark(false, step);
  }

  void press(const Vector3d& to, double feed_mm_min, const Step& step) {
    const Vector3d by_mm = to - here_;
    move(to, feed_mm_min, Way::measure);
    if (seeks(step)) std::get<Move>(blocks_.back()).by_mm = by_mm;
  }

  // The device that a tool that cuts is set by need not be at the skip input.
  static bool seeks(const Step& step) {
    const bool touches = step.kind == Kind::touch || step.kind == Kind::in_out;
    return touches && !(step.feature == procedure::Feature::tool_setter && step.touch.tool != 0);
  }

  void seek(const Step& step, const Place& place) {
    const Vector3d surface = surfaceOf(step, place, setting_), retract = vectorOf(step.touch.retract_direction);
    blocks_.push_back(Seek{.to_mm = surface - seekOf(setting_) * retract,
                           .off_mm = step.clearance_mm * retract,
                           .feed_mm_min = std::min(setting_.seek_mm_min, setting_.near_mm_min)});
  }

  // In contact from the first mark to the second. At a mark somebody may have stood for long, so that behind it the
  // mask of the probe begins anew.
  void scan(const Step& step, const Place& place) {
    const ScanPath& path = step.touch.scan;
    const double feed = step.touch.retract_speed_mm_s * 60;
    double angle_rad = path.start_rad;
    const auto at = [&](double depth_mm) {
      const double radius_mm = place.half_mm.x() - depth_mm;
      return Vector3d{place.centre_mm + radius_mm * Vector3d{std::cos(angle_rad), std::sin(angle_rad), 0}};
    };
    blocks_.push_back(Contact{true});
    move(at(path.depths_mm[0]), std::min(setting_.near_mm_min, feed), Way::measure);
    blocks_.push_back(Wait{kSettle_s});
    mark(true, step);
    double masked_s = kMask_s;
    for (std::size_t i = 0; i < waysOf(path); ++i) {
      const ScanWay way = wayOf(path, i);
      const Eigen::Vector2d to_centre_mm = (place.centre_mm - here_).head<2>();
      const double way_mm = std::abs(way.turn_rad) * to_centre_mm.norm();
      const double lasts_s = way_mm / step.touch.retract_speed_mm_s + kStop_s;
      if (masked_s + lasts_s > kMask_s) {
        blocks_.push_back(Contact{.begin = true, .renews = true});
        masked_s = 0;
      }
      masked_s += lasts_s;
      angle_rad += way.turn_rad;
      move(at(way.to_depth_mm), feed, Way::measure);
      if (way.is_arc) std::get<Move>(blocks_.back()).arc = Arc{to_centre_mm, way.turn_rad < 0};
    }
    blocks_.push_back(Wait{kAfter_s});
    mark(false, step);
    blocks_.push_back(Contact{.begin = true, .renews = true});
    move(at(-step.clearance_mm), std::min(setting_.near_mm_min, feed), Way::measure);
    blocks_.push_back(Contact{false});
  }

  // Wherever the machine stands above the safe height.
  void rest(const Step& step) {
    rise();
    if (!started_) takeUp(step, setting_.at_mm);
    blocks_.push_back(Note{promptFor(plan_, index_)});
    blocks_.push_back(Wait{kSettle_s});
    mark(true, step);
    blocks_.push_back(Wait{step.touch.rest_s + kAfter_s});
    mark(false, step);
  }

  // One axis alone, from the place that the operator has chosen.
  void alone(const Step& step) {
    rise();
    if (!started_) takeUp(step, setting_.at_mm);
    blocks_.push_back(Note{promptFor(plan_, index_)});
    const Vector3d begin{setting_.at_mm.x(), setting_.at_mm.y(), *setting_.safe_z_mm};
    if (!(here_ == begin)) move(begin, setting_.traverse_mm_min, Way::level);
    blocks_.push_back(Wait{kSettle_s});
    mark(true, step);
    const double feed = step.touch.retract_speed_mm_s * 60;
    move(begin + step.touch.travel_mm * vectorOf(step.touch.outward_normal), feed, Way::measure);
    blocks_.push_back(Wait{kAfter_s});
    mark(false, step);
  }

  const procedure::Plan& plan_;
  const Setting& setting_;
  Blocks blocks_;
  std::array<bool, 3> used_{};
  bool any_turns_{};  // a step states its angles
  std::size_t index_{};
  std::optional<Place> near_;
  Vector3d here_{Vector3d::Constant(std::nan(""))};
  bool started_{};
  bool turns_anew_{true};  // nothing is known of the angles
  bool tip_control_{};
  std::uint32_t tool_{};
  std::uint16_t mount_{};
  std::array<double, 3> angles_rad_{};
};

}  // namespace

Outcome<Blocks> unroll(const procedure::Plan& plan, const Setting& setting) {
  if (auto error = whyNot(plan, setting)) return *error;
  TRY(auto blocks, Unroller{plan, setting}.write());
  if (auto error = whyThroughNeighbour(plan, blocks, setting)) return *error;
  return blocks;
}

double seekOf(const Setting& setting) {
  return std::min(setting.seek_mm, setting.deflection_limit_mm);
}

double liftOfDryRun(const Blocks& blocks, double safe_z_mm) {
  double lowest_mm = safe_z_mm;
  for (const auto& block : blocks) {
    if (const auto* move = std::get_if<Move>(&block)) lowest_mm = std::min(lowest_mm, move->to_mm.z());
  }
  return safe_z_mm - lowest_mm;
}

Blocks dryRun(const Blocks& blocks, double lift_mm) {
  Blocks dry;
  for (const auto& block : blocks) {
    if (std::holds_alternative<Mark>(block) || std::holds_alternative<Stop>(block) ||
        std::holds_alternative<Contact>(block) || std::holds_alternative<Seek>(block))
      continue;
    dry.push_back(block);
    if (auto* move = std::get_if<Move>(&dry.back())) {
      move->to_mm.z() += lift_mm;
      move->by_mm.reset();
      move->free = move->free || (move->way == Way::measure && !move->arc);  // nothing is touched up there
    }
  }
  return dry;
}

}  // namespace probebox::gcode
