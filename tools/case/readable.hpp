#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"

// Formats values of results for people; every page and command uses these functions.
namespace probebox::casefolder {

// Display name and unit of a key such as "tau_s" or "location_mm[1]".
struct Label {
  std::string name;    // "tau"
  std::string unit;    // "us"; empty: none
  double factor{1.0};  // from the key's unit to this one
};

// True for an error, whose largest component is the worst.
bool isError(std::string_view key);

// True for a value whose ideal is zero: an error, or the lean of an axis from its nominal direction. A limit bounds the
// value itself with its U, and not U alone. Takes keys of components too: "A_tilt_rad[0]".
bool hasIdealZero(std::string_view key);

// A component that is zero by definition, such as the location of an axis along itself: value and sd are zero while
// another component of the estimate has an sd.
bool zeroByDefinition(const metrology::Estimate& estimate, std::size_t k);

// Times are shown in us, errors in um, small rotations in urad, other angles in degrees; other units as in the key.
Label labelOf(std::string_view key);

// "5447.1 +/- 5.0 us": value and standard uncertainty (k = 1), in the key's unit, to the last place of two digits of
// it. Callers give the combined one, with type B, where it is known.
std::string withUncertainty(const Label& label, double value, std::optional<double> u);

// "5447.1": the value alone, with as many decimal places as withUncertainty() gives it.
std::string valueText(const Label& label, double value, std::optional<double> sd);

// "10 us": an uncertainty, given in the key's unit, to two digits.
std::string withUnit(const Label& label, double uncertainty);

// "10 us" of one cause, or "0 us" where it is nothing beside the whole.
std::string shareText(const Label& label, double share, double whole);

// Formats the scatter of readings in um or urad instead of 9.856e-04 mm or 4.3e-06 rad. unit: of the value.
std::string ofAReading(double value, const std::string& unit);

// "reduced chi-square 1.4 at 20 degrees of freedom (99.9 % of honest readings: 0.27 to 2.4)"; without degrees of
// freedom the number alone. Only for a result that has one.
std::string chiSquareText(const metrology::Result& result);

// Sets a text for a medium that has the signs: "5.2 +/- 0.4 um" becomes "5.2 \u00b1 0.4 \u00b5m". Units are changed
// behind numbers, in brackets and where they are the whole text, so that words such as "us" stay.
std::string typeset(std::string_view text);

// "tau is 20 us per um of one touch": sensitivity of a value to the sigma of one reading. design_per: the reading, with
// its unit as the last word.
std::string designText(const std::string& key, double figure, const std::string& design_per);

}  // namespace probebox::casefolder
