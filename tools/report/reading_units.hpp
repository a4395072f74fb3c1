#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace probebox::report {

// Label and scale of a plot's axis for a key of a case: "C_rad" is shown as "C (deg)", "t_s" as "time (s)".
struct AxisUnit {
  std::string label;
  double factor{1.0};  // from the key's unit to that of the label
};
AxisUnit axisUnitOf(std::string_view key);

// Chooses a finer unit for small numbers: um below 0.1 mm, urad below 0.1 rad. quantity: "residual".
AxisUnit fineUnit(const std::string& quantity, std::string_view unit, const std::vector<double>& values);

}  // namespace probebox::report
