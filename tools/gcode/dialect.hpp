#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/gcode/block.hpp"

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
  virtual ~Dialect() = default;
  virtual std::string_view name() const = 0;
  virtual std::string_view control() const = 0;
  // A sentence: on what controls or simulators programs of this dialect have run.
  virtual std::string_view tried() const = 0;
  // What the control needs for these marks, one sentence per line.
  virtual std::vector<std::string> needs(Marks marks) const = 0;

  virtual std::vector<std::string> head(std::string_view title) const = 0;
  // Sets the modes. device: line to the box, for dialects whose programs name it; empty: the usual one.
  virtual std::vector<std::string> start(Marks marks, std::string_view device) const = 0;
  virtual std::vector<std::string> end(Marks marks) const = 0;
  virtual std::string comment(std::string_view text) const;
  virtual std::string move(const Move& move) const;
  virtual std::string turn(const Turn& turn) const;
  virtual std::vector<std::string> take(const TakeTool& tool) const;
  // Empty where the control has none.
  virtual std::string tipControl(const TipControl& tip) const = 0;
  virtual std::string wait(double s) const;
  virtual std::vector<std::string> stop(std::string_view text) const;
  virtual std::vector<std::string> mark(const Mark& mark) const = 0;
};

// Returns a dialect by its name; nullptr if it is unknown.
const Dialect* dialectNamed(std::string_view name);
std::span<const std::string_view> dialectNames();

// One instance each.
const Dialect& linuxcnc();
const Dialect& fanuc();
const Dialect& siemens();
const Dialect& haas();

// With three decimals and a decimal point, and no "-0.000".
std::string decimal(double value);
// Pure ASCII that every control's comment or message may hold: capital letters, no brackets, no quotation marks.
std::string plain(std::string_view text);
// "BEGIN 3" or "END 3", as firmware/tape reads it.
std::string nameOf(const Mark& mark);

}  // namespace probebox::gcode
