#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"

// Values of results as people read them; everything that prints one prints it like this.
namespace probebox::casefolder {

// A key such as "tau_s" or "location_mm[1]" taken apart: what it is, and the unit that a person reads.
struct Label {
  std::string name;    // "tau"
  std::string unit;    // "us"; empty: none
  double factor{1.0};  // from the key's unit to this one
};

// Whether the value is an error, that ought to be small: its largest is its worst.
bool isError(std::string_view key);

// A component that is zero by definition, such as the location of an axis along itself: value and sd are zero while
// another component of the estimate has an sd.
bool zeroByDefinition(const metrology::Estimate& estimate, std::size_t k);

// Times are read in us, errors in um, small rotations in urad; other units are as the key names them.
Label labelOf(const std::string& key);

// "5447.1 +/- 5.0 us": value and sd (in the key's unit) to the two digits of the sd that mean something.
std::string withSd(const Label& label, double value, std::optional<double> sd);

// "5447.1": the value alone, with the same digits.
std::string valueText(const Label& label, double value, std::optional<double> sd);

// "10 us": an uncertainty (in the key's unit) to two digits.
std::string withUnit(const Label& label, double uncertainty);

// "reduced chi-square 1.4 at 20 degrees of freedom (99.9 % of honest readings: 0.27 to 2.4)"; without degrees of
// freedom (a result of an older version) the number alone. Only for a result that has one.
std::string chiSquareText(const metrology::Result& result);

// "tau is 20 us per um of one touch": what the sigma of one reading (design_per, whose last word is its unit) does to a
// value.
std::string designText(const std::string& key, double figure, const std::string& design_per);

}  // namespace probebox::casefolder
