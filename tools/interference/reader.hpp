#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/interference/block.hpp"
#include "tools/interference/codes.hpp"

namespace probebox::interference {

// Whether the control adds the tool's length. never_said: the zero is where the program's tool has its tip.
enum class Length : std::uint8_t { never_said, on, off };

// What the blocks before have left.
struct Modes {
  Motion motion{};
  int cycle{};  // 81 for G81; 0 for none
  std::size_t normal{2};
  double unit_mm{1};
  bool relative{}, absolute_middle{}, ends_at_r{};
  Length length{};
  bool z_without_length{};  // Z was commanded before any G43
  std::optional<int> zero;  // number of the coordinate system
  Point base_mm{};          // G10 against the zero of the cell
  Point local_mm{};         // G52 or G92
  bool placed{};            // by G92
  std::uint32_t tool{};
  std::optional<std::uint32_t> chosen_tool;
  // Where the tip is, in the cell's program coordinates.
  Point at{};
  Angles at_deg{};
  std::array<bool, 3> known{};
  std::array<bool, 3> touched{};  // since a probing move, which may have ended anywhere on its way
  // Of the canned cycle, mm as they were given.
  std::optional<double> cycle_r, cycle_z;
  bool cycle_relative{};
  double initial_z{}, cycle_shift_mm{};
  bool operator==(const Modes&) const = default;
};

// Executes the blocks of a program.
class Reader {
 public:
  Reader(const Dialect& dialect, bool siemens) : dialect_{dialect}, siemens_{siemens} { modes_.tool = dialect.tool; }

  // text: a block as bare() returns it. idle: it may be executed or not, and so may change nothing.
  std::optional<Refusal> read(std::string_view text, std::size_t line, bool idle);
  bool ended() const { return ended_; }
  std::vector<Move> moves() { return std::move(moves_); }

 private:
  // The words for axes of a block, as places.
  struct Target {
    Point to{};
    Angles to_deg{};
    std::array<bool, 3> said{}, absolute{}, turned{};
    bool turns() const { return turned[0] || turned[1] || turned[2]; }
    bool any() const { return said[0] || said[1] || said[2] || turns(); }
  };
  // The codes of a block.
  struct Orders {
    std::vector<Code> codes;
    std::optional<Code> once;
    const Code* of(Group group) const;
  };

  std::optional<Refusal> execute(Block& block);
  Outcome<Orders, Refusal> ordersOf(Block& block) const;
  static std::optional<Refusal> takeQuiet(Block& block, const Orders& orders);
  std::optional<Refusal> takeTool(Block& block);
  std::optional<Refusal> change(const Block& block);
  std::optional<Refusal> setModes(Block& block, const Orders& orders);
  std::optional<Refusal> setLength(Block& block, const Code* code);
  std::optional<Refusal> lengthOn(const Block& block, double h);
  std::optional<Refusal> setZero(const Block& block, double number);
  std::optional<Refusal> once(Block& block, const Orders& orders);
  std::optional<Refusal> home(Block& block);
  std::optional<Refusal> writeZero(Block& block);
  std::optional<Refusal> shift(Block& block);
  std::optional<Refusal> setPlace(Block& block);
  std::optional<Refusal> motion(Block& block, const Orders& orders);
  std::optional<Refusal> move(Block& block, bool probes);
  std::optional<Refusal> machineMotion(Block& block);
  std::optional<Refusal> arc(Block& block, const Target& target);
  Outcome<std::array<double, 2>, Refusal> middleOf(Block& block, const Target& target) const;
  Outcome<std::array<double, 2>, Refusal> middleByRadius(const Block& block, const Target& target, double radius) const;
  std::optional<Refusal> cycle(Block& block, const Code* code);
  std::optional<Refusal> hole(const Block& block, const Target& target);
  std::optional<Refusal> straight(const Block& block, const Point& to, Way way);
  std::optional<Refusal> shifted(const Block& block);

  Outcome<Target, Refusal> target(Block& block) const;
  std::optional<Refusal> turn(Block& block, Target& target) const;
  std::optional<Refusal> checkLength(const Block& block, const Target& target) const;
  std::optional<Refusal> go(const Block& block, const Target& target, Way way);
  std::optional<Refusal> add(const Block& block, Move move);
  bool allKnown() const { return modes_.known[0] && modes_.known[1] && modes_.known[2]; }
  bool isAbove() const { return modes_.known[2] && modes_.at[2] == kAbove_mm; }
  bool anyTouched() const { return modes_.touched[0] || modes_.touched[1] || modes_.touched[2]; }

  Dialect dialect_;
  bool siemens_{};
  Modes modes_;
  bool ended_{};
  std::size_t repeated_{};  // holes
  std::vector<Move> moves_;
};

}  // namespace probebox::interference
