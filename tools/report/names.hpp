#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/estimate.hpp"
#include "tools/case/readable.hpp"
#include "tools/report/subject.hpp"

namespace probebox::report {

// Letter of the rotary axis that the result is about, from its direction ("C" along Z) or the dataset's key `axis`;
// "" if neither determines it.
std::string axisLetter(const Subject& subject);

// Name of value k as the field has it: "EXC at 60 deg", "deviation XC at 60 deg", "XOC", "centre X", "Z at B = 30 deg,
// L = 100 mm", "sector 3". Error letters of rotary axes are those of ISO 230-7:2015: EXC to ECC are error motions, XOC,
// YOC, AOC, BOC location; a deviation is both together.
std::string valueName(const Subject& subject, const metrology::Estimate& estimate, std::size_t k);

// Tests whether the rows of a matrix are angles of the axis.
bool isByAngle(const metrology::Estimate& estimate);

// Names a row of a matrix ("60 deg", "B = 30 deg, L = 100 mm", "1") and a column ("EXC", "X").
std::string rowName(const Subject& subject, const metrology::Estimate& estimate, std::size_t row);
std::string columnName(const Subject& subject, const metrology::Estimate& estimate, std::size_t column);

// Title of the object: "deviations of the axis: ...", "sector table".
std::string titleOf(const metrology::Estimate& estimate);

// Display unit (casefolder::labelOf); error motions of a rotary axis in um and urad.
casefolder::Label unitOf(const metrology::Estimate& estimate, std::size_t k);

// Combined standard uncertainty of value k; nothing where it is unknown.
std::optional<double> combinedOf(const metrology::Estimate& estimate, std::size_t k);
std::optional<double> sdOf(const metrology::Estimate& estimate, std::size_t k);

// "-13.4": the value in its unit, to the second digit of U = 2 u (k = 2).
std::string valueDigits(const casefolder::Label& unit, double value, std::optional<double> u);
// "1.1": U itself, to two digits.
std::string uncertaintyDigits(const casefolder::Label& unit, double u);
// "XOC = -10.74 um, U = 0.63 um (k = 2)".
std::string sentenceOf(const Subject& subject, const metrology::Estimate& estimate, std::size_t k);

}  // namespace probebox::report
