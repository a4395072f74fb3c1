#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// The estimates of a result that are about the subject: those that a case with two subjects found for this one, and the
// place of an axis whose method promises its direction alone. For other subjects: all that the result promises.
std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject);

// Unit of the residual rms: mm, um, rad. Residuals are not stored with a result; what one reading is (design_per) ends
// with it.
std::string unitOfRms(const Result& result);

}  // namespace probebox::metrology
