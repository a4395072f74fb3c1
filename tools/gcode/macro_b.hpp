#pragma once
#include <string>
#include <vector>

#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {

// Shared by Fanuc's custom macro B and its relatives: lines are printed by DPRNT.
class MacroB : public Dialect {
 public:
  // Milliseconds without a decimal point: their meaning does not depend on the control's parameters.
  std::string wait(double s) const override;
  // first: blocks that keep the control from printing before the motion has ended.
  std::vector<std::string> printed(const Mark& mark, const std::vector<std::string>& first) const;
};

}  // namespace probebox::gcode
