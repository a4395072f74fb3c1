#include "tools/gcode/program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "protocol/units/angle.hpp"
#include "tools/gcode/points_of.hpp"
#include "tools/gcode/unroll.hpp"

namespace probebox::gcode {
namespace {

constexpr std::size_t kColumns = 64;  // of a comment

struct Extent {
  Eigen::Vector3d least{Eigen::Vector3d::Constant(1e9)}, most{Eigen::Vector3d::Constant(-1e9)};
  double fastest_mm_min{};

  explicit Extent(const Blocks& blocks) {
    Eigen::Vector3d here = Eigen::Vector3d::Zero();
    for (const auto& block : blocks) {
      const auto* move = std::get_if<Move>(&block);
      if (move == nullptr) continue;
      fastest_mm_min = std::max(fastest_mm_min, move->feed_mm_min);
      if (!knowsPlace(*move)) continue;
      for (const auto& point : pointsOf(*move, here)) {
        least = least.cwiseMin(point);
        most = most.cwiseMax(point);
      }
      here = move->to_mm;
    }
  }
};

class Writer {
 public:
  Writer(const Dialect& dialect, const Setting& setting, Marks marks)
      : dialect_{dialect}, setting_{setting}, marks_{marks} {}

  void line(const std::string& text) { text_ += text + "\n"; }
  void lines(const std::vector<std::string>& all) {
    for (const auto& one : all) line(one);
  }
  // Broken at words: controls cut long comments.
  void comment(std::string_view text) {
    while (text.size() > kColumns) {
      auto cut = text.rfind(' ', kColumns);
      if (cut == std::string_view::npos || cut == 0) cut = kColumns;
      line(dialect_.comment(text.substr(0, cut)));
      text.remove_prefix(std::min(text.size(), text[cut] == ' ' ? cut + 1 : cut));
    }
    line(dialect_.comment(text));
  }

  void operator()(const Move& move) {
    if (move.by_mm && sought_) return lines(dialect_.moveBy(*move.by_mm, move.feed_mm_min));
    if (move.length) {
      tip_control_ = move.length->tip_control;
      lines(dialect_.takeLength(move));
    } else if (move.free && guards()) {
      lines(dialect_.guarded(move));
    } else {
      line(dialect_.move(move));
    }
    if (move.axes == Move::Axes::z && guards()) lines(dialect_.atHeight(move.to_mm.z()));
  }
  void operator()(const Seek& seek) {
    sought_ = guards();
    if (!sought_) return;
    lines(dialect_.seek({.to_mm = seek.to_mm, .feed_mm_min = seek.feed_mm_min}));
    lines(dialect_.contact({.begin = true}));
    lines(dialect_.moveBy(seek.off_mm, seek.feed_mm_min));
    lines(dialect_.contact({.begin = false}));
  }
  void operator()(const Turn& turn) {
    lines(turn.feed_deg_min && guards() ? dialect_.guardedTurn(turn, setting_.words)
                                        : dialect_.turn(turn, setting_.words));
  }
  void operator()(const Retract& retract) {
    tip_control_ = false;
    lines(dialect_.retract(retract, setting_.machine_z_mm));
  }
  void operator()(const TakeTool& tool) { lines(dialect_.takeAnew(tool)); }
  void operator()(const CheckLength&) { lines(dialect_.checkLength()); }
  void operator()(const Contact& contact) {
    if (setting_.guard) lines(dialect_.contact(contact));
  }
  void operator()(const Wait& wait) { line(dialect_.wait(wait.s)); }
  void operator()(const Stop& stop) { lines(dialect_.stop(stop)); }
  void operator()(const Note& note) { comment(note.text); }
  void operator()(const Mark& mark) {
    if (marks_ == Marks::lines) return lines(dialect_.mark(mark));
    const std::string step = "STEP " + std::to_string(mark.step + 1) + " " + nameOf(mark);
    lines(dialect_.stop({step + ": PRESS ENTER AT THE PC, THEN CYCLE START", step}));
  }
  void all(const Blocks& blocks) {
    for (const auto& block : blocks) std::visit(*this, block);
  }
  std::string take() { return std::move(text_); }

 private:
  bool guards() const { return setting_.guard && (!tip_control_ || dialect_.guardsUnderTipControl()); }

  const Dialect& dialect_;
  const Setting& setting_;
  Marks marks_;
  bool tip_control_{};
  bool sought_{};  // moves with by_mm count from a contact
  std::string text_;
};

std::string toolsOf(const Blocks& blocks, const Setting& setting, const Dialect& dialect) {
  std::set<std::uint32_t> numbers;
  bool checked = false;
  for (const auto& block : blocks) {
    if (const auto* tool = std::get_if<TakeTool>(&block)) numbers.insert(tool->number);
    checked = checked || std::holds_alternative<CheckLength>(block);
  }
  if (checked)
    return "No tool is called: " +
           std::string{dialect.isLathe() ? "the turret stands at the probe, its"
                                         : "the probe is in the spindle, its length"} +
           " offset active. The program ends with an alarm "
           "where none is active, and cannot see whose it is: --probe-tools NUMBER makes it call the tool.";
  std::string text;
  for (const auto number : numbers) text += (text.empty() ? "" : ", ") + std::string{"tool "} + std::to_string(number);
  return "It takes " + text + ", each with the offset of its own number. Before that " +
         dialect.retracting(setting.machine_z_mm) + ", and " + (dialect.isLathe() ? "X moves" : "X and Y move") +
         " at that height to above the place.";
}

std::string wordOf(std::size_t axis, const Setting& setting, const Dialect& dialect) {
  const std::string& word = setting.words[axis];
  if (!word.empty()) return word;
  const std::string usual = dialect.orient(0);
  return usual.substr(0, usual.find('0'));
}

std::array<bool, 3> rotaryOf(const Blocks& blocks) {
  std::array<bool, 3> used{};
  for (const auto& block : blocks) {
    const auto* turn = std::get_if<Turn>(&block);
    for (std::size_t axis = 0; turn != nullptr && axis < 3; ++axis) used[axis] = used[axis] || turn->used[axis];
  }
  return used;
}

void explainRotary(Writer& to, const Blocks& blocks, const Setting& setting, const Dialect& dialect) {
  const auto used = rotaryOf(blocks);
  if (used == std::array<bool, 3>{}) {
    to.comment(
        "No rotary axis is moved, and the spindle is not oriented: have all at 0, and the probe as it always is.");
    return;
  }
  constexpr std::array<const char*, 3> kMeanings{
      "orientation of the spindle that holds the probe, not a rotary axis A of the machine",
      "tilting table or swivel head", "turning axis along Z"};
  to.comment("Angles in comments and in lines to the box, and the words of this control:");
  std::string rest;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!used[axis]) {
      rest += std::string{" "} + "ABC"[axis];
      continue;
    }
    std::string meaning = kMeanings[axis];
    if (axis == 1) {
      const char* sign = setting.b_axis.sum() < 0 ? "-" : "+";
      meaning += std::string{", right-handed about "} + sign + (setting.b_axis.x() != 0 ? "X" : "Y");
    }
    if (axis == 2) meaning += ", counterclockwise from above where it is plus";
    to.comment(std::string{"- "} + "ABC"[axis] + ": " + meaning + ". Word: " + wordOf(axis, setting, dialect));
  }
  to.comment("Another control has other words: --words. The others stand at 0, where the machine has them:" +
             (rest.empty() ? " none." : rest + "."));
}

std::string from(double least, double most) {
  return decimal(least) + " to " + decimal(most);
}

// Explains in comments what turns, where, and how the linear axes move meanwhile.
void explainClearance(Writer& to, const Blocks& blocks, const Setting& setting, double lift_mm) {
  std::array<double, 2> sine{}, down{};
  bool tip_control = false, turns = false;
  for (const auto& block : blocks) {
    const auto* turn = std::get_if<Turn>(&block);
    if (turn == nullptr) continue;
    turns = turns || turn->used[1] || turn->used[2];
    if (!turn->feed_deg_min) continue;
    tip_control = true;
    const double tilt_rad = radians(turn->to_deg[1]);
    // About X the pivot goes to -Y, about Y to +X.
    const double across = setting.b_axis.y() * std::sin(tilt_rad) - setting.b_axis.x() * std::sin(tilt_rad);
    sine = {std::min(sine[0], across), std::max(sine[1], across)};
    down = {std::min(down[0], std::cos(tilt_rad) - 1), std::max(down[1], std::cos(tilt_rad) - 1)};
  }
  const std::string height = "Z " + decimal(*setting.safe_z_mm);
  if (turns)
    to.comment("Rotary axes turn with the tip at " + height + " in the run and " + decimal(lift_mm) +
               " mm higher in the dry run. Have clear, at every tilt on the way from one angle to the next: the table "
               "with all that is on it, and spindle, head and holder around the tip.");
  if (!tip_control) return;
  to.comment(
      "While the head swivels, G1 keeps the tip in place, and the machine's own axes travel, by the distance from "
      "the head's pivot to the tip times: " +
      std::string{setting.b_axis.x() != 0 ? "Y " : "X "} + from(sine[0], sine[1]) + ", Z " + from(down[0], down[1]) +
      ".");
}

std::optional<double> lowestArc(const Blocks& blocks) {
  std::optional<double> lowest_mm;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    if (move != nullptr && move->arc) lowest_mm = std::min(lowest_mm.value_or(move->to_mm.z()), move->to_mm.z());
  }
  return lowest_mm;
}

void explainStops(Writer& to, const Blocks& blocks, const Setting& setting, const Dialect& dialect) {
  bool tip_control = false;
  for (const auto& block : blocks) {
    const auto* move = std::get_if<Move>(&block);
    tip_control = tip_control || (move != nullptr && move->length && move->length->tip_control);
  }
  to.comment("The box only advises: no motion stop depends on it. The probe's skip input stays wired to the control.");
  to.comment(
      "The probe has to be switched on before the start and until the end: a wireless one by the M code or the turn "
      "that "
      "its maker says. While it is off the control sees no touch, and nothing stops any move.");
  if (!setting.guard) {
    to.comment("Nothing stops when the probe touches: --no-skip was given. Have a hand on the feed hold.");
    return;
  }
  if (tip_control && !dialect.guardsUnderTipControl()) {
    to.comment("Nothing stops when the probe touches: " + std::string{dialect.guardWord()} +
               " is not possible under tip control. Have a hand on the feed hold.");
    return;
  }
  to.comment("Protected: " + std::string{dialect.guardWord()} +
             " ends each straight move that is to meet nothing when the probe touches, and an alarm ends the program.");
  to.comment("Before each touch the probe seeks the surface at " + decimal(setting.seek_mm_min) + " mm/min, up to " +
             decimal(seekOf(setting)) +
             " mm beyond its place, and is then pressed from the contact: an alarm where nothing is touched. Not so a "
             "tool that "
             "cuts: the setting device need not be at the skip input.");
  to.comment(
      "Not protected, nothing stops these: each step from its begin to its end, into the surface and back. The first "
      "moves of dry run and run, up to the first place at the safe height. Tool changes with their moves of Z, and "
      "across to the next place. Rotary axes, but those that swivel a head under tip control.");
  if (const auto lowest_mm = lowestArc(dryRun(blocks, liftOfDryRun(blocks, *setting.safe_z_mm))))
    to.comment("Not protected either: arcs of the scan in the dry run. No skip input ends an arc. They run at Z " +
               decimal(*lowest_mm) + " or higher, not below the safe height.");
  for (const auto& need : dialect.guardNeeds()) to.comment(need);
}

void explain(Writer& to, const Blocks& measured, const Setting& setting, const Heading& heading, const Dialect& dialect,
             Marks marks) {
  const Extent path{measured};
  const double lift_mm = liftOfDryRun(measured, *setting.safe_z_mm);
  to.comment("Control: " + std::string{dialect.control()} + ".");
  to.comment(dialect.machines());
  to.comment(dialect.tried());
  explainStops(to, measured, setting, dialect);
  to.comment("NEEDS:");
  to.comment("On the box first: " + heading.command);
  to.comment("G54: " + heading.zero);
  to.comment("Coordinates are of the centre of the stylus ball, or of the tip of a tool that is measured.");
  to.comment(toolsOf(measured, setting, dialect));
  explainRotary(to, measured, setting, dialect);
  explainClearance(to, measured, setting, lift_mm);
  to.comment("Nothing above Z " + decimal(*setting.safe_z_mm) + " in G54, which is the safe height. Travel: X " +
             from(path.least.x(), path.most.x()) +
             (dialect.isLathe() ? " in radius" : ", Y " + from(path.least.y(), path.most.y())) + ", Z " +
             from(path.least.z(), path.most.z()) + ", in the dry run up to " + decimal(path.most.z() + lift_mm) + ".");
  to.comment("Fastest feed: " + decimal(path.fastest_mm_min) +
             " mm/min. At rapid: rotary axes, where no tip is kept in place, and Z up before a tool is taken or tip "
             "control ends. The box wants measuring feeds at 100 percent: no override there.");
  for (const auto& need : dialect.needs(marks)) to.comment(need);
  to.comment(std::string{"LEAVES BEHIND: spindle and coolant stopped, "} +
             (dialect.isLathe() ? "the turret at the last tool, its offset active"
                                : "the last tool in the spindle, its length offset active unless a head swivelled") +
             ", Z at the safe height or higher, rotary axes at the last angles; " + std::string{dialect.leaves()});
}

}  // namespace

std::optional<Error> whySwivelsUnguarded(const Blocks& blocks, const Setting& setting, const Dialect& dialect) {
  const bool swivels = std::ranges::any_of(blocks, [](const Block& block) {
    const auto* turn = std::get_if<Turn>(&block);
    return turn != nullptr && turn->feed_deg_min;
  });
  if (!swivels || !setting.guard || dialect.guardsUnderTipControl()) return std::nullopt;
  return Error{
      "On this control no skip input stops a head that swivels under tip control, nor any move then: let the "
      "control read its steps from the box (--loop, which swivels above everything without tip control), or "
      "give --no-skip where a person watches the run with a hand on the feed hold."};
}

std::string program(const Blocks& blocks, const Setting& setting, const Heading& heading, const Dialect& dialect,
                    Marks marks) {
  const double lift_mm = liftOfDryRun(blocks, *setting.safe_z_mm);
  const std::string safe = decimal(*setting.safe_z_mm);
  Writer to{dialect, setting, marks};
  to.lines(dialect.head("PROBEBOX " + heading.method, heading.number));
  explain(to, blocks, setting, heading, dialect, marks);
  to.lines(dialect.start(marks, heading.device));
  to(Stop{"IS THE PROBE AT OR ABOVE Z " + safe + " AND THE OVERRIDE LOW? THE DRY RUN FOLLOWS",
          "ABOVE SAFE Z? DRY RUN"});
  to.comment("DRY RUN: the path of the run, all of it " + decimal(lift_mm) + " mm higher, at or above Z " + safe);
  to.all(dryRun(blocks, lift_mm));
  to(Stop{"DRY RUN DONE. OVERRIDE 100 PERCENT, RUN BEGUN ON THE BOX? START TOUCHES THE PART",
          "RUN ON BOX? 100 PERCENT?"});
  to.comment("THE RUN");
  to.all(blocks);
  to.lines(dialect.end(marks));
  return to.take();
}

}  // namespace probebox::gcode
