#pragma once
#include <string>
#include <vector>

#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {

// What Fanuc's custom macro B and its relatives share: lines are printed by DPRNT from variables.
class MacroB : public Dialect {
 public:
  // Milliseconds without a decimal point, which every parameter setting reads alike.
  std::string wait(double s) const override;
  // `first`: what keeps the control from printing before the motion has ended.
  std::vector<std::string> printed(const Mark& mark, const std::vector<std::string>& first) const;
};

}  // namespace probebox::gcode
