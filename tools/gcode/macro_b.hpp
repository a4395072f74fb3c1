#pragma once
#include <string>
#include <vector>

#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {

// Shared by Fanuc's custom macro B and its relatives: lines are printed by DPRNT, alarms and stops are raised by system
// variables. Only local variables are written, which end with the program.
class MacroB : public Dialect {
 public:
  bool hasTipControl() const override { return true; }
  std::string_view guardWord() const override { return "G31"; }
  // G49 in one block with G53: alone it moves Z by the tool's length where bit 6 of parameter 5006 is 0.
  Lines retract(const Retract& retract, double machine_z_mm) const override;
  Lines takeLength(const Move& move) const override;
  Lines checkLength() const override;
  // Milliseconds without a decimal point: their meaning does not depend on the control's parameters.
  std::string wait(double s) const override;
  Lines stop(const Stop& stop) const override;
  // Cancels a local shift, and refuses what else an earlier program may have left that moves the tip elsewhere.
  virtual Lines cleared() const;
  // first: blocks that keep the control from printing before the motion has ended.
  Lines printed(const Mark& mark, const Lines& first) const;

 private:
  virtual std::string_view tipControl() const = 0;
};

}  // namespace probebox::gcode
