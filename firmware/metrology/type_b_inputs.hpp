#pragma once
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One quantity that the measurement rests on and that its readings do not tell: a certificate, a temperature.
struct TypeBInput {
  std::string name;  // of the budget line: "sd_gap_mm"; "sd_part_mm[2]" where a key stands for several numbers
  double sd{};       // k = 1
  // The case with the quantity off by so many sd.
  std::function<void(Dataset&, double)> move;
  bool in_sd{};  // the method's own sd holds it already
};

// Keys sd_<known quantity> of the method, and of the temperature: see docs/metrology.md, "Uncertainty".
std::vector<std::string_view> typeBKeys(std::string_view method);

// What the case states. Refuses: bad-config (no number above zero, as large as the quantity itself, a temperature or an
// expansion of another unit), missing-key (an uncertainty without its quantity).
Outcome<std::vector<TypeBInput>, Refusal> typeBInputs(const Dataset& dataset);

// The case with every known size of the method as it is at temperature_c, from its size at 20 degrees and
// expansion_per_k; unchanged without these keys.
Dataset atTemperature(const Dataset& dataset);

}  // namespace probebox::metrology
