#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/gcode/block.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// How the box learns that a step begins or ends.
enum class Marks : std::uint8_t {
  lines,  // the control prints a line to the box's tape: face
  stops,  // the program stops, and a person presses Enter at `probebox calibrate`
};

// Writes blocks in the language of one control. Each dialect is a class in a file of its own; the base has what most of
// them share.
class Dialect {
 public:
  using Lines = std::vector<std::string>;

  virtual ~Dialect() = default;
  virtual std::string_view name() const = 0;
  virtual std::string_view control() const = 0;
  // True for a lathe of X and Z with a turret.
  virtual bool isLathe() const { return false; }
  // One sentence about the machines that these programs are for.
  virtual std::string machines() const;
  // One sentence that names the controls or simulators on which programs of this dialect have run.
  virtual std::string_view tried() const = 0;
  // What the control is left with at the end, and after an alarm, beyond what all are: one sentence.
  virtual std::string_view leaves() const = 0;
  // Requirements of these marks on the control, one sentence per line.
  virtual Lines needs(Marks marks) const = 0;
  // Requirements on the control for moves that its skip input stops, and the word for such a move.
  virtual Lines guardNeeds() const = 0;
  virtual std::string_view guardWord() const = 0;
  // True if the control has a code that keeps the tip in place while a head swivels.
  virtual bool hasTipControl() const = 0;
  // True if moves can be stopped by the skip input while it does.
  virtual bool guardsUnderTipControl() const { return false; }

  // number: of the program, where the control has one.
  virtual Lines head(std::string_view title, std::uint32_t number) const = 0;
  // Modal state of each move: plane, units, work offset, absolute positions, feed per minute. A builder's tool change
  // may leave another one.
  virtual Lines modes() const = 0;
  // Sets the modes and refuses what is left of another program. device: line to the box, for dialects whose programs
  // name it; empty: the usual one.
  virtual Lines start(Marks marks, std::string_view device) const = 0;
  virtual Lines end(Marks marks) const = 0;
  virtual std::string comment(std::string_view text) const;
  virtual std::string move(const Move& move) const;
  // The same, stopped with an alarm when the probe touches.
  virtual Lines guarded(const Move& move) const = 0;
  // To where the probe touches; an alarm where it does not.
  virtual Lines seek(const Move& move) const = 0;
  // From where the axes stand.
  virtual Lines moveBy(const Eigen::Vector3d& by_mm, double feed_mm_min) const;
  // A move of Z that activates a length offset.
  virtual Lines takeLength(const Move& move) const = 0;
  // After the first move of Z to a known height, with a length offset: for dialects whose checks need it.
  virtual Lines atHeight(double) const { return {}; }
  // Orients the spindle; from 0 to 360 degrees.
  virtual std::string orient(double angle_deg) const;
  virtual Lines turn(const Turn& turn, const Words& words) const;
  // Under tip control, stopped with an alarm when the probe touches: for dialects that can.
  virtual Lines guardedTurn(const Turn& turn, const Words& words) const { return this->turn(turn, words); }
  virtual Lines retract(const Retract& retract, double machine_z_mm) const = 0;
  // The same in words, as text to follow "Before that ".
  virtual std::string retracting(double machine_z_mm) const;
  virtual Lines take(const TakeTool& tool) const;
  // The same, and the modes again.
  Lines takeAnew(const TakeTool& tool) const;
  virtual Lines checkLength() const = 0;
  virtual Lines contact(const Contact&) const { return {}; }
  // How long the control masks a probe that is pressed into a surface, s, until an exact stop at which that begins
  // anew; nothing where it does not stop such moves.
  virtual std::optional<double> mask_s() const { return std::nullopt; }
  virtual std::string wait(double s) const;
  virtual Lines stop(const Stop& stop) const = 0;
  virtual Lines mark(const Mark& mark) const = 0;

 protected:
  // " X1.000 Y2.000 Z3.000" of the axes that a move commands.
  std::string placeWords(const Move& move) const;
  // Letters of the linear axes, as the control numbers them from 1, and what it calls an mm of X.
  std::string_view linearAxes() const { return isLathe() ? "XZ" : "XYZ"; }
  virtual double xFactor() const { return 1; }

 private:
  // Lathe features of this control that programs of a mill do not have, as text to follow "no ".
  virtual std::string_view lathe() const { return ""; }
};

// Returns a dialect by its name; nullptr if it is unknown.
const Dialect* dialectNamed(std::string_view name);
std::span<const std::string_view> dialectNames();

// One instance each.
const Dialect& linuxcnc();
const Dialect& fanuc();
const Dialect& fanucLathe();
const Dialect& siemens();
const Dialect& siemensLathe();
const Dialect& haas();

// With three decimals and a decimal point, and no "-0.000".
std::string decimal(double value);
// Pure ASCII that every control's comment or message may hold: capital letters, no brackets, no quotation marks.
std::string plain(std::string_view text);
// "BEGIN 3" or "END 3", as firmware/tape reads it.
std::string nameOf(const Mark& mark);
// "M19 R" is a block of its own; "B" and "C1=" are words that move with others.
bool isAxisWord(std::string_view word);

}  // namespace probebox::gcode
