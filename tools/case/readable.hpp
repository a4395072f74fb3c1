#pragma once
#include <optional>
#include <string>

// Values of results as people read them; everything that prints one prints it like this.
namespace probebox::casefolder {

// A key such as "tau_s" taken apart: what it is, and the unit that a person reads.
struct Label {
  std::string name;    // "tau"
  std::string unit;    // "us"; empty: none
  double factor{1.0};  // from the key's unit to this one
};

// Times in seconds are read in microseconds; other units are as the key names them.
Label labelOf(const std::string& key);

// "5447.1 +/- 5.0 us": value and sd (in the key's unit) to the two digits of the sd that mean something.
std::string withSd(const Label& label, double value, std::optional<double> sd);

}  // namespace probebox::casefolder
