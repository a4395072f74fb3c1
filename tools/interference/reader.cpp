#include "tools/interference/reader.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::interference {
namespace {

constexpr std::size_t kMostMoves = 10'000'000;
constexpr std::size_t kMostRepeated = 100'000;  // holes
constexpr double kMostTurns = 10'000;           // of an arc
constexpr double kSamePlace_mm = 5e-4;          // half of the least increment of controls
constexpr double kMostTool = 99;                // number that a cell may describe

// How far the end of an arc may be from its circle.
double tolerance_mm(double radius) {
  return std::max(0.01, 1e-3 * radius);
}

}  // namespace

const Code* Reader::Orders::of(Group group) const {
  const auto found = std::ranges::find(codes, group, &Code::group);
  return found == codes.end() ? nullptr : &*found;
}

std::optional<Refusal> Reader::read(std::string_view text, std::size_t line, bool idle) {
  TRY(auto block, Block::of(std::string{text}, line));
  if (!idle) return execute(block);
  const auto before = modes_;
  const auto had = moves_.size();
  const bool went_on = !ended_;
  if (auto refusal = execute(block)) return refusal;
  if (went_on && ended_) ended_ = false;
  if (modes_ == before && moves_.size() == had) return std::nullopt;
  return block.refusal("conditional-motion",
                       "a block that may be skipped changes the path: remove the slash or the condition, or the block");
}

std::optional<Refusal> Reader::execute(Block& block) {
  TRY(const auto orders, ordersOf(block));
  if (auto refusal = takeQuiet(block, orders)) return refusal;
  if (auto refusal = takeTool(block)) return refusal;
  if (auto refusal = setModes(block, orders)) return refusal;
  if (auto refusal = once(block, orders)) return refusal;
  if (auto refusal = motion(block, orders)) return refusal;
  if (const auto word = block.leftOver())
    return block.refusal("unread-word",
                         "no code of its block takes the word " + *word + ": remove it, or write the code");
  const auto ends = [](double m) { return m == 2 || m == 30; };
  ended_ = ended_ || std::ranges::any_of(block.m(), ends);
  return std::nullopt;
}

Outcome<Reader::Orders, Refusal> Reader::ordersOf(Block& block) const {
  Orders orders;
  for (const double g : block.g()) {
    TRY(const auto code, codeOf(g, siemens_, block.line()));
    const bool twice = code.group == Group::once ? orders.once.has_value()
                                                 : code.group != Group::quiet && orders.of(code.group) != nullptr;
    if (twice) return block.refusal("codes-disagree", "two G codes that exclude each other: write two blocks");
    if (code.group == Group::once) orders.once = code;
    orders.codes.push_back(code);
  }
  return orders;
}

// Feeds, speeds and numbers, and the words of codes that change no path.
std::optional<Refusal> Reader::takeQuiet(Block& block, const Orders& orders) {
  for (const char letter : {'N', 'O', 'F', 'S'}) block.take(letter);
  for (const auto& code : orders.codes) {
    for (const char letter : code.words) block.take(letter);
  }
  for (const double m : block.m()) {
    TRY(const auto letters, wordsOfM(m, block.line()));
    for (const char letter : letters) block.take(letter);
  }
  return std::nullopt;
}

std::optional<Refusal> Reader::takeTool(Block& block) {
  if (const auto number = block.take('T')) {
    if (*number != std::floor(*number) || *number < 0 || *number > kMostTool)
      return block.refusal("not-a-tool",
                           "T is no number of a tool, 0 to 99: tool and offset in one word, as lathes have them, are "
                           "not followed");
    modes_.chosen_tool = static_cast<std::uint32_t>(*number);
  }
  return std::ranges::find(block.m(), 6) == block.m().end() ? std::nullopt : change(block);
}

// Where the machine stands after a change, controls do not agree: only above everything it is of no account.
std::optional<Refusal> Reader::change(const Block& block) {
  if (!modes_.chosen_tool || *modes_.chosen_tool == modes_.tool) return std::nullopt;
  const auto next = *modes_.chosen_tool;
  if (next != 0 && std::ranges::find(dialect_.tools, next) == dialect_.tools.end())
    return block.refusal("other-tool", "tool " + std::to_string(next) +
                                           " is taken, and the cell has no [[tool]] of that number: describe it there");
  if (modes_.known[2] && !isAbove())
    return block.refusal(
        "change-at-height",
        "where the machine stands after a tool change, controls do not agree: write G91 G28 Z0 before");
  modes_.tool = next;
  modes_.z_without_length = false;
  if (modes_.length == Length::on) modes_.length = Length::off;
  return std::nullopt;
}

std::optional<Refusal> Reader::setModes(Block& block, const Orders& orders) {
  for (const auto& code : orders.codes) {
    switch (code.does) {
      case Does::plane:
        modes_.normal = static_cast<std::size_t>(code.value);
        break;
      case Does::unit:
        modes_.unit_mm = code.value;
        break;
      case Does::distance:
        modes_.relative = code.value != 0;
        break;
      case Does::arc_middle:
        modes_.absolute_middle = code.value != 0;
        break;
      case Does::cycle_end:
        modes_.ends_at_r = code.value != 0;
        break;
      case Does::zero:
        if (auto refusal = setZero(block, code.value)) return refusal;
        break;
      default:
        break;
    }
  }
  return setLength(block, orders.of(Group::length));
}

// The cell states the zero of one coordinate system: that which the program names first.
std::optional<Refusal> Reader::setZero(const Block& block, double number) {
  const int chosen = static_cast<int>(number);
  const bool moved = modes_.known[0] || modes_.known[1] || (modes_.known[2] && !isAbove());
  const int before = modes_.zero.value_or(moved ? 1 : chosen);
  if (before != chosen)
    return block.refusal("other-zero", "a second coordinate system: the cell states the zero of one alone");
  modes_.zero = chosen;
  return std::nullopt;
}

std::optional<Refusal> Reader::setLength(Block& block, const Code* code) {
  if (siemens_) {
    if (const auto edge = block.take('D')) return lengthOn(block, *edge == 0 ? 0.0 : modes_.tool);
  }
  if (code != nullptr && code->does == Does::length_off) {
    if (block.take('H').value_or(0) != 0)
      return block.refusal("wrong-length", "G49 with H: controls do not agree whether the length counts; remove one");
    if (modes_.length == Length::on) modes_.length = Length::off;
    return std::nullopt;
  }
  if (code == nullptr && modes_.length != Length::on) return std::nullopt;
  const auto h = block.take('H');
  if (h) return lengthOn(block, *h);
  if (code == nullptr) return std::nullopt;
  return block.refusal("wrong-length", "G43 without H: write the number of the length, which is that of the tool");
}

std::optional<Refusal> Reader::lengthOn(const Block& block, double h) {
  if (h == 0) {
    modes_.length = Length::off;
    return std::nullopt;
  }
  if (h != modes_.tool)
    return block.refusal("wrong-length", "the length is not that of tool " + std::to_string(modes_.tool) +
                                             ", which is in the spindle: write its number behind H");
  if (modes_.length == Length::never_said && modes_.z_without_length && !isAbove())
    return block.refusal("late-length",
                         "the length of the tool begins here, and Z was commanded before: where the tip was then is "
                         "not known; write G43 before the first Z");
  modes_.length = Length::on;
  return std::nullopt;
}

std::optional<Refusal> Reader::once(Block& block, const Orders& orders) {
  if (!orders.once) return std::nullopt;
  switch (orders.once->does) {
    case Does::dwell:
      // The first of these is the time; feed and speed, which are taken by now, are for Siemens.
      for (const char letter : {'P', 'X', 'U'}) {
        if (block.take(letter)) break;
      }
      return std::nullopt;
    case Does::home:
      return home(block);
    case Does::set_zero:
      return writeZero(block);
    case Does::shift:
      return shift(block);
    case Does::set_place:
      return setPlace(block);
    case Does::unset_place:
      if (modes_.placed) modes_.local_mm = {}, modes_.placed = false;
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

// To the reference point by way of a place (G28, G30). Its Z is above everything; where its X and Y are, the cell does
// not say.
std::optional<Refusal> Reader::home(Block& block) {
  TRY(auto way, target(block));
  const bool all = !way.any();
  const bool across = all || way.said[0] || way.said[1];
  if (across && modes_.known[2] && !isAbove())
    return block.refusal("home-at-height",
                         "where the reference point is in X and Y is not known: write G91 G28 Z0 before, alone");
  const bool stays = way.absolute == std::array<bool, 3>{} && way.to == modes_.at && way.to_deg == modes_.at_deg;
  if (!stays) {
    if (auto refusal = checkLength(block, way)) return refusal;
    if (auto refusal = go(block, way, Way::rapid)) return refusal;
  }
  Target end{modes_.at, modes_.at_deg, {}, {}, {}};
  for (std::size_t k = 0; k < 3; ++k) end.to_deg[k] = way.turned[k] ? 0 : end.to_deg[k];
  if (all || way.said[2]) end.to[2] = kAbove_mm, end.absolute[2] = true;
  if (auto refusal = go(block, end, Way::rapid)) return refusal;
  if (all || way.said[0]) modes_.known[0] = false;
  if (all || way.said[1]) modes_.known[1] = false;
  return std::nullopt;
}

std::optional<Refusal> Reader::writeZero(Block& block) {
  const auto l = block.take('L'), p = block.take('P'), turned = block.take('R');
  const bool of_this = p && (*p == modes_.zero.value_or(1) || *p == 0);
  if (!l || *l != 2 || !of_this || (turned && *turned != 0) || modes_.relative)
    return block.refusal("other-zero",
                         "G10 writes offsets: only G90 G10 L2 with the P of the coordinate system in use is followed");
  modes_.zero = modes_.zero.value_or(1);
  for (std::size_t k = 0; k < 3; ++k) {
    if (const auto value = block.take("XYZ"[k])) modes_.base_mm[k] = *value * modes_.unit_mm - dialect_.zero_mm[k];
  }
  return std::nullopt;
}

std::optional<Refusal> Reader::shift(Block& block) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = block.take("XYZ"[k]);
    if (!value) continue;
    if (*value != 0 && (modes_.relative || modes_.placed))
      return block.refusal("other-zero", "G52 in G91 or after G92: controls do not agree what it adds to; remove one");
    if (!modes_.placed) modes_.local_mm[k] = *value * modes_.unit_mm;
  }
  return std::nullopt;
}

std::optional<Refusal> Reader::setPlace(Block& block) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = block.take("XYZ"[k]);
    if (!value) continue;
    if (!modes_.known[k] || modes_.touched[k] || (k == 2 && isAbove()))
      return block.refusal("unknown-place", "G92 where the place of the axis is not known: command it before");
    modes_.local_mm[k] = modes_.at[k] - modes_.base_mm[k] - *value * modes_.unit_mm;
    modes_.placed = true;
  }
  return std::nullopt;
}

std::optional<Refusal> Reader::motion(Block& block, const Orders& orders) {
  const Code* code = orders.of(Group::motion);
  if (orders.of(Group::cycle_off) != nullptr) modes_.cycle = 0;
  if (code != nullptr && code->does == Does::motion) {
    modes_.motion = static_cast<Motion>(static_cast<int>(code->value));
    modes_.cycle = 0;
  }
  const auto does = orders.once ? orders.once->does : Does::nothing;
  if (does == Does::machine) return machineMotion(block);
  const bool moves_on = does == Does::nothing || does == Does::probe || (does == Does::dwell && code != nullptr);
  if (!moves_on) return std::nullopt;
  const bool starts_cycle = code != nullptr && code->does == Does::cycle;
  if ((starts_cycle || modes_.cycle != 0) && does != Does::probe) return cycle(block, starts_cycle ? code : nullptr);
  return move(block, does == Does::probe || modes_.motion == Motion::probe);
}

std::optional<Refusal> Reader::move(Block& block, bool probes) {
  TRY(const auto end, target(block));
  const bool is_arc = !probes && (modes_.motion == Motion::clockwise || modes_.motion == Motion::counterclockwise);
  const bool has_middle = block.has('I') || block.has('J') || block.has('K') || block.has('R');
  if (!end.any() && !(is_arc && has_middle)) return std::nullopt;
  if (!probes && modes_.motion == Motion::none)
    return block.refusal("no-motion-code", "a word for an axis before G0 to G3 has said how to move");
  if (auto refusal = checkLength(block, end)) return refusal;
  if (end.said[2] && modes_.length == Length::never_said) modes_.z_without_length = true;
  if (is_arc) return arc(block, end);
  return go(block, end, probes ? Way::probe : modes_.motion == Motion::rapid ? Way::rapid : Way::feed);
}

// G53. Machine coordinates are of the gauge line, and its Z 0 is the upper end of travel.
std::optional<Refusal> Reader::machineMotion(Block& block) {
  Target end{modes_.at, modes_.at_deg, {}, {}, {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = block.take("XYZ"[k]);
    if (!value) continue;
    if (k == 2 && *value != 0)
      return block.refusal("machine-height",
                           "how high the tip is at a machine Z other than 0 is not known: write Z in G54, or G53 Z0");
    end.to[k] = k == 2 ? kAbove_mm : *value * modes_.unit_mm - dialect_.zero_mm[k];
    end.said[k] = end.absolute[k] = true;
  }
  if (auto refusal = turn(block, end)) return refusal;
  if (!end.any()) return std::nullopt;
  const bool straight = modes_.motion == Motion::rapid || modes_.motion == Motion::feed;
  if (modes_.relative || !straight || modes_.cycle != 0)
    return block.refusal("machine-motion",
                         "G53 with G91, or without G0 or G1: controls do not agree; write G90 G53 G0");
  return go(block, end, modes_.motion == Motion::rapid ? Way::rapid : Way::feed);
}

std::optional<Refusal> Reader::arc(Block& block, const Target& end) {
  if (!allKnown() || isAbove())
    return block.refusal("unknown-place", "an arc from a place that is not known: command X, Y and Z before");
  if (end.turns()) return block.refusal("arc-while-turning", "an arc while a rotary axis turns: write it with G1");
  TRY(const auto middle, middleOf(block, end));
  const auto turns = block.take('P').value_or(1);
  if (turns != std::floor(turns) || turns < 1 || turns > kMostTurns)
    return block.refusal("bad-arc", "P is the number of turns, from 1 to 10000: correct it");
  const std::size_t first = (modes_.normal + 1) % 3, second = (modes_.normal + 2) % 3;
  const double fx = modes_.at[first] - middle[0], fy = modes_.at[second] - middle[1];
  const double tx = end.to[first] - middle[0], ty = end.to[second] - middle[1];
  const double radius = std::hypot(fx, fy);
  if (!(radius > 0) || std::abs(std::hypot(tx, ty) - radius) > tolerance_mm(radius))
    return block.refusal("bad-arc", "the end of the arc is not on its circle: correct its middle or its end");
  const bool whole = std::hypot(tx - fx, ty - fy) < kSamePlace_mm;
  const bool clockwise = modes_.motion == Motion::clockwise;
  double angle = whole ? 0 : std::atan2(fx * ty - fy * tx, fx * tx + fy * ty);
  if (clockwise && angle >= 0) angle -= kTurn;
  if (!clockwise && angle <= 0) angle += kTurn;
  if (auto refusal = go(block, end, Way::feed)) return refusal;
  auto& made = moves_.back();
  made.normal = static_cast<std::uint8_t>(modes_.normal);
  made.middle = middle;
  made.turn_rad = angle + std::copysign(kTurn * (turns - 1), angle);
  return std::nullopt;
}

Outcome<std::array<double, 2>, Refusal> Reader::middleOf(Block& block, const Target& end) const {
  if (const auto radius = block.take('R')) return middleByRadius(block, end, *radius * modes_.unit_mm);
  std::array<double, 2> middle{};
  std::size_t given = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t axis = (modes_.normal + 1 + k) % 3;
    const auto word = block.take("IJK"[axis]);
    const double zero = modes_.absolute_middle ? modes_.base_mm[axis] + modes_.local_mm[axis] : modes_.at[axis];
    middle[k] = zero + word.value_or(0) * modes_.unit_mm;
    given += word ? 1u : 0u;
  }
  if (given < (modes_.absolute_middle ? 2u : 1u))
    return block.refusal("bad-arc", "an arc without its middle: write I and J (G17), I and K (G18) or J and K (G19)");
  return middle;
}

// Seen along the way the middle lies left of it for G3, and right for G2; the other way round where R is negative.
Outcome<std::array<double, 2>, Refusal> Reader::middleByRadius(const Block& block, const Target& end,
                                                               double radius) const {
  const std::size_t first = (modes_.normal + 1) % 3, second = (modes_.normal + 2) % 3;
  const double dx = end.to[first] - modes_.at[first], dy = end.to[second] - modes_.at[second];
  const double chord = std::hypot(dx, dy), beyond = chord / 2 - std::abs(radius);
  if (chord < kSamePlace_mm)
    return block.refusal("bad-arc", "an arc by R that ends where it begins has any middle: write I and J");
  if (beyond > tolerance_mm(std::abs(radius)) / 2)
    return block.refusal("bad-arc", "R is smaller than half the way to the end of the arc: correct it");
  const double height = beyond >= 0 ? 0 : std::sqrt(radius * radius - chord * chord / 4);
  const bool left = (modes_.motion == Motion::counterclockwise) == (radius > 0);
  const double side = left ? height : -height;
  return std::array{(modes_.at[first] + end.to[first]) / 2 - side * dy / chord,
                    (modes_.at[second] + end.to[second]) / 2 + side * dx / chord};
}

// Canned cycles: to the hole at the height where it begins, rapid to R, in feed to Z, and back. Pecks stay in the hole.
std::optional<Refusal> Reader::cycle(Block& block, const Code* code) {
  if (code != nullptr) {
    if (modes_.cycle == 0) modes_.initial_z = modes_.at[2], modes_.cycle_r.reset(), modes_.cycle_z.reset();
    modes_.cycle = static_cast<int>(code->value);
    modes_.cycle_shift_mm = 0;
  }
  const auto r = block.take('R'), z = block.take('Z'), dwell_or_peck = block.take('Q');
  block.take('P');
  if (modes_.cycle == 76 && dwell_or_peck) modes_.cycle_shift_mm = std::abs(*dwell_or_peck) * modes_.unit_mm;
  if (r) modes_.cycle_r = *r * modes_.unit_mm;
  if (z) modes_.cycle_z = *z * modes_.unit_mm;
  if (r || z) modes_.cycle_relative = modes_.relative;
  const auto l = block.take('L');
  const auto times = l ? l : block.take('K');
  TRY(auto place, target(block));
  if (!place.any() && !r && !z) return std::nullopt;
  const double count = times.value_or(1);
  if (count != std::floor(count) || count < 0 || count > 9999)
    return block.refusal("bad-cycle", "the number of repeats is 0 to 9999: correct it");
  if (count > 1) repeated_ += static_cast<std::size_t>(count);
  if (repeated_ > kMostRepeated)
    return block.refusal("too-many-moves", "more than 100000 repeated holes: check the program in parts");
  const std::array increment{place.to[0] - modes_.at[0], place.to[1] - modes_.at[1]};
  for (double n = 0; n < count; ++n) {
    if (auto refusal = hole(block, place)) return refusal;
    for (std::size_t k = 0; k < increment.size(); ++k) place.to[k] += modes_.relative ? increment[k] : 0;
  }
  return std::nullopt;
}

std::optional<Refusal> Reader::straight(const Block& block, const Point& to, Way way) {
  return go(block, {to, modes_.at_deg, {true, true, true}, {true, true, true}, {}}, way);
}

std::optional<Refusal> Reader::hole(const Block& block, const Target& place) {
  const bool mixed = modes_.cycle_relative != modes_.relative || (modes_.relative && isAbove());
  if (!modes_.cycle_r || !modes_.cycle_z || mixed || modes_.normal != 2)
    return block.refusal("bad-cycle", "a canned cycle needs R and Z, in G17, given in the same of G90 and G91");
  auto above = place;
  above.to[2] = modes_.at[2];
  auto lowered = above;
  lowered.said[2] = lowered.absolute[2] = true;
  if (auto refusal = checkLength(block, lowered)) return refusal;
  if (modes_.length == Length::never_said) modes_.z_without_length = true;
  if (auto refusal = go(block, above, Way::rapid)) return refusal;
  if (!allKnown() || anyTouched())
    return block.refusal("unknown-place", "a canned cycle from a place that is not known: command X, Y and Z before");
  const double zero = modes_.relative ? modes_.initial_z : modes_.base_mm[2] + modes_.local_mm[2];
  const double r = zero + *modes_.cycle_r, z = (modes_.relative ? r : zero) + *modes_.cycle_z;
  if (modes_.at[2] < r - kSamePlace_mm || z > r + kSamePlace_mm)
    return block.refusal("bad-cycle",
                         "a canned cycle that begins below its R, or has its Z above it: controls do not "
                         "agree on its path; begin above R");
  const auto& [x, y, height] = modes_.at;
  if (auto refusal = straight(block, {x, y, r}, Way::rapid)) return refusal;
  if (auto refusal = straight(block, {x, y, z}, Way::feed)) return refusal;
  if (auto refusal = shifted(block)) return refusal;
  const bool out_in_feed = modes_.cycle == 74 || modes_.cycle == 84 || modes_.cycle == 85 || modes_.cycle == 89;
  const double end = modes_.ends_at_r ? r : std::max(r, modes_.initial_z);
  return straight(block, {x, y, end}, out_in_feed ? Way::feed : Way::rapid);
}

// Of G76 at the bottom: in which direction, a parameter of the machine says.
std::optional<Refusal> Reader::shifted(const Block& block) {
  if (modes_.cycle_shift_mm == 0) return std::nullopt;
  const auto at = modes_.at;
  for (const auto& [x, y] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}}) {
    const Point to{at[0] + x * modes_.cycle_shift_mm, at[1] + y * modes_.cycle_shift_mm, at[2]};
    if (auto refusal = straight(block, to, Way::feed)) return refusal;
    if (auto refusal = straight(block, at, Way::feed)) return refusal;
  }
  return std::nullopt;
}

Outcome<Reader::Target, Refusal> Reader::target(Block& block) const {
  Target end{modes_.at, modes_.at_deg, {}, {}, {}};
  for (std::size_t k = 0; k < end.to.size(); ++k) {
    const auto value = block.take("XYZ"[k]);
    if (!value) continue;
    end.said[k] = true;
    if (!modes_.relative) {
      end.to[k] = *value * modes_.unit_mm + modes_.base_mm[k] + modes_.local_mm[k];
      end.absolute[k] = true;
    } else if (*value != 0) {
      if (!modes_.known[k] || (k == 2 && isAbove()))
        return block.refusal("unknown-place", "G91 before the place of the axis is known: begin with G90");
      end.to[k] += *value * modes_.unit_mm;
    }
  }
  if (auto refusal = turn(block, end)) return *refusal;
  return end;
}

// Where the cell describes no such axis, it is at 0 and stays there.
std::optional<Refusal> Reader::turn(Block& block, Target& end) const {
  for (std::size_t k = 0; k < end.to_deg.size(); ++k) {
    const auto value = block.take("ABC"[k]);
    if (!value) continue;
    end.to_deg[k] = (modes_.relative ? modes_.at_deg[k] : 0) + *value;
    if (!dialect_.rotary[k] && end.to_deg[k] != 0)
      return block.refusal("no-rotary-axis",
                           std::string{"a word "} + "ABC"[k] + ": the cell has no [[rotary_axis]] of that letter");
    end.turned[k] = dialect_.rotary[k];
  }
  return std::nullopt;
}

// Without its length the tip is lower than the program says, by as much as the control does not add.
std::optional<Refusal> Reader::checkLength(const Block& block, const Target& end) const {
  const bool lifts = end.said[2] && (end.absolute[2] || end.to[2] != modes_.at[2]);
  const bool low = modes_.known[2] && !isAbove();
  if (modes_.length != Length::off || (!lifts && !low)) return std::nullopt;
  return block.refusal("length-off",
                       "the length of the tool is off (G49, H0, D0 or another tool), so the tip no longer follows the "
                       "program: write G43 with H before");
}

std::optional<Refusal> Reader::go(const Block& block, const Target& end, Way way) {
  const bool from_known = allKnown();
  for (std::size_t k = 0; k < 3; ++k) {
    if (way == Way::probe) {
      modes_.touched[k] = modes_.touched[k] || end.to[k] != modes_.at[k];
    } else if (end.absolute[k]) {
      modes_.touched[k] = false;
    }
    modes_.known[k] = modes_.known[k] || end.absolute[k];
  }
  Move made{block.line(), modes_.tool, way, modes_.at, end.to, modes_.at_deg, end.to_deg, end.absolute};
  modes_.at = end.to;
  modes_.at_deg = end.to_deg;
  const bool stays_above = made.from[2] == kAbove_mm && made.to[2] == kAbove_mm;
  if (!from_known || stays_above) return std::nullopt;
  return add(block, made);
}

std::optional<Refusal> Reader::add(const Block& block, Move made) {
  if (made.tool == 0)
    return block.refusal("other-tool", "a move without a tool in the spindle: take one with T and M6");
  if (moves_.size() == kMostMoves)
    return block.refusal("too-many-moves", "more than 10 million moves: check the program in parts");
  moves_.push_back(made);
  return std::nullopt;
}

}  // namespace probebox::interference
