#pragma once
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Takes centre_mm of result `of` to the height z_mm, with its standard deviations: along its own slope, or that of
// `beside`, with which it is compared: one height does not tell it. Changes nothing without a height or a slope.
void moveCentre(double z_mm, const Result& of, const Result& beside, Estimate& centre);

}  // namespace probebox::metrology
