#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// The estimates of a result that are about the subject: those that a case with two subjects found for this one, and the
// place of an axis whose method promises its direction alone. For other subjects: all that the result promises.
std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject);

// Those of them that are compared with the result in force about the subject, and others that are compared always
// (Quantity::compared).
std::vector<Estimate> valuesCompared(const Result& result, std::string_view subject);

// The result with the value of one key under another, in its covariance and its worst-determined combination too.
Result withKey(Result result, std::string_view key, std::string_view as);

// Unit of the residual rms: mm, um, rad. Residuals are not stored with a result; what one reading is (design_per) ends
// with it.
std::string unitOfRms(const Result& result);

// Takes centre_mm of result `of` to the height z_mm, with its standard deviations: along its own slope, or that of
// `beside`, with which it is compared: one height does not tell it. Changes nothing without a height or a slope.
void moveCentre(double z_mm, const Result& of, const Result& beside, Estimate& centre);

}  // namespace probebox::metrology
