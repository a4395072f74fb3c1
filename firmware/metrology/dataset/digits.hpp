#pragma once

namespace probebox::metrology {

// The decimal place that a number is given to, as a length: 0.001 of 12.345. At least 1e-9.
double digitOf(double value);

}  // namespace probebox::metrology
