#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace probebox::report {

// How numbers under a key of a case stand on an axis: "C_rad" as "C (deg)", "t_s" as "time (s)".
struct AxisUnit {
  std::string label;
  double factor{1.0};  // from the key's unit to that of the label
};
AxisUnit axisUnitOf(std::string_view key);

// The unit in which small numbers read well: mm as um below 0.1 mm, rad as urad below 0.1 rad. quantity: "residual".
AxisUnit fineUnit(const std::string& quantity, std::string_view unit, const std::vector<double>& values);

}  // namespace probebox::report
