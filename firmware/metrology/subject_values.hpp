#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// The keys of the estimates that count for subjects whose names begin so; "" in what is left over.
struct KeysAbout {
  std::string_view stem;
  std::array<std::string_view, 3> keys;
};

// The estimates that the first of `listed` whose stem fits names, as far as the result has them; nullopt where none
// fits.
std::optional<std::vector<Estimate>> estimatesListed(const Result& result, std::span<const KeysAbout> listed,
                                                     std::string_view subject);

// The estimates of a result that are about the subject: those that a case with two subjects found for this one, and the
// place of an axis whose method promises its direction alone. For other subjects: all that the result promises.
std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject);

// The result with the value of one key under another, in its covariance and its worst-determined combination too.
Result withKey(Result result, std::string_view key, std::string_view as);

// Unit of the residual rms: mm, um, rad. Residuals are not stored with a result; what one reading is (design_per) ends
// with it.
std::string unitOfRms(const Result& result);

}  // namespace probebox::metrology
