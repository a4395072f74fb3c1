#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "tools/case/readable.hpp"

// Lists the values of a result one by one, with display names and units.
namespace probebox::casefolder {

struct Quantity {
  std::string key;                 // as programs address it: "centre_mm[0]", "deviation_XC_at_60_deg_mm"
  Label label;                     // "centre X" in mm; "deviation XC at 60 deg" in um
  double value{};                  // in the key's unit, as sd and expanded
  std::optional<double> sd;        // k = 1
  std::optional<double> expanded;  // U, k = 2, type B inputs included
  bool by_definition{};            // zero by definition, such as the location of an axis along itself

  // Combined standard uncertainty (k = 1), shown after +/-; the sd if it is not known.
  std::optional<double> uncertainty() const { return expanded ? std::optional{*expanded / 2} : sd; }
};

// axis: the letter of the rotary axis that the result is about, empty for none. Errors of a rotary axis are named as in
// ISO 230: EXC to ECC for error motions, XOC and AOC for location; "deviation XC" is their sum.
std::vector<Quantity> quantitiesOf(const metrology::Result& result, std::string_view axis = {});

// The values of one of its estimates, also of those that it does not promise.
std::vector<Quantity> quantitiesIn(const metrology::Result& result, const metrology::Estimate& estimate,
                                   std::string_view axis = {});

// Those that are about the subject (metrology::valuesAbout).
std::vector<Quantity> quantitiesAbout(const metrology::Result& result, std::string_view subject);

// Name and unit of one such key.
Label quantityLabel(const std::string& key, std::string_view axis = {});

// "C" for the subject "rotary-c"; empty for one that is about no rotary axis.
std::string rotaryAxisOf(std::string_view subject);

// Explains the names of ISO 230-7 that the values of a result have: "Names of ISO 230-7: XOC and YOC are errors of the
// position of C in the X and Y directions, ...". Empty for a result without such names.
std::string axisNamesInWords(const metrology::Result& result, std::string_view axis);

// "5447.1 us, sd 5.0 us, U 10 us"; "sd not known" where it is not.
std::string withSdAndU(const Quantity& quantity);

}  // namespace probebox::casefolder
