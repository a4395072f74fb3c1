#include "tools/gcode/program.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <vector>

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
      if (move->z_only) continue;
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
  Writer(const Dialect& dialect, Marks marks) : dialect_{dialect}, marks_{marks} {}

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

  void operator()(const Move& move) { line(dialect_.move(move)); }
  void operator()(const Turn& turn) { line(dialect_.turn(turn)); }
  void operator()(const TakeTool& tool) { lines(dialect_.take(tool)); }
  void operator()(const TipControl& tool) { line(dialect_.tipControl(tool)); }
  void operator()(const Wait& wait) { line(dialect_.wait(wait.s)); }
  void operator()(const Stop& stop) { lines(dialect_.stop(stop.text)); }
  void operator()(const Note& note) { comment(note.text); }
  void operator()(const Mark& mark) {
    if (marks_ == Marks::lines) return lines(dialect_.mark(mark));
    lines(dialect_.stop(nameOf(mark) + " OF STEP " + std::to_string(mark.step + 1) +
                        ": PRESS ENTER AT THE PC, THEN CYCLE START"));
  }
  void all(const Blocks& blocks) {
    for (const auto& block : blocks) std::visit(*this, block);
  }
  std::string take() { return std::move(text_); }

 private:
  const Dialect& dialect_;
  Marks marks_;
  std::string text_;
};

std::string toolsOf(const Blocks& blocks) {
  std::set<std::uint32_t> numbers;
  for (const auto& block : blocks) {
    if (const auto* tool = std::get_if<TakeTool>(&block)) numbers.insert(tool->number);
  }
  std::string text;
  for (const auto number : numbers)
    text += (text.empty() ? "" : ", ") + (number == 0 ? std::string{"the probe"} : "tool " + std::to_string(number));
  return text;
}

std::string rotaryOf(const Blocks& blocks) {
  std::array<bool, 3> used{};
  for (const auto& block : blocks) {
    const auto* turn = std::get_if<Turn>(&block);
    for (std::size_t axis = 0; turn != nullptr && axis < 3; ++axis) used[axis] = used[axis] || turn->used[axis];
  }
  std::string turned, rest;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    (used[axis] ? turned : rest) += std::string{" "} + "ABC"[axis];
  }
  return (turned.empty() ? "No rotary axis is moved." : "Rotary axes that are moved:" + turned + ".") +
         (rest.empty() ? "" : " Have these at 0, where the machine has them:" + rest + ".");
}

std::string from(double least, double most) {
  return decimal(least) + " to " + decimal(most);
}

void explain(Writer& to, const Blocks& measured, const Blocks& dry, const Setting& setting, const Heading& heading,
             const Dialect& dialect, Marks marks) {
  const Extent path{measured}, above{dry};
  to.comment("Control: " + std::string{dialect.control()} + ".");
  to.comment(dialect.tried());
  to.comment("The box only advises: no motion stop depends on it. The probe's skip input stays wired to the control.");
  to.comment("NEEDS:");
  to.comment("On the box first: " + heading.command);
  to.comment("G54: " + heading.zero);
  to.comment(
      "Coordinates are of the centre of the stylus ball, or of the tip of a tool that is measured, with its length "
      "offset active: " +
      toolsOf(measured) + ".");
  to.comment(rotaryOf(measured));
  to.comment("Nothing above Z " + decimal(*setting.safe_z_mm) + " in G54, which is the safe height. Travel: X " +
             from(path.least.x(), path.most.x()) + ", Y " + from(path.least.y(), path.most.y()) + ", Z " +
             from(path.least.z(), std::max(path.most.z(), above.most.z())) + ".");
  to.comment(
      "Fastest feed: " + decimal(path.fastest_mm_min) +
      " mm/min, and no rapid of a linear axis. The box wants measuring feeds at 100 percent: no override there.");
  for (const auto& need : dialect.needs(marks)) to.comment(need);
}

}  // namespace

std::string program(const Blocks& blocks, const Setting& setting, const Heading& heading, const Dialect& dialect,
                    Marks marks) {
  const Blocks dry = dryRun(blocks, *setting.safe_z_mm);
  Writer to{dialect, marks};
  to.lines(dialect.head("PROBEBOX " + heading.method));
  explain(to, blocks, dry, setting, heading, dialect, marks);
  to.lines(dialect.start(marks, heading.device));
  to(Stop{"IS THE PROBE AT OR ABOVE Z " + decimal(*setting.safe_z_mm) + " AND THE OVERRIDE LOW? THE DRY RUN FOLLOWS"});
  to.comment("DRY RUN ABOVE THE PART: the whole path, nothing below Z " + decimal(*setting.safe_z_mm));
  to.all(dry);
  to(Stop{"DRY RUN DONE. OVERRIDE 100 PERCENT, RUN BEGUN ON THE BOX? START TOUCHES THE PART"});
  to.comment("THE RUN");
  to.all(blocks);
  to.lines(dialect.end(marks));
  return to.take();
}

}  // namespace probebox::gcode
