#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The cell of a store that stands for a config key, and the sd beside it.
struct StoredLength {
  std::string_view table;
  std::string_view column;
  std::size_t row{};
  double sd{};
};
// Finds that cell; nothing where no store stands for the key or its sd is zero.
using StoreReader = std::optional<StoredLength> (*)(const Dataset& dataset, std::string_view key);

// One quantity that the measurement rests on and that its readings do not tell: a certificate, a temperature.
struct TypeBInput {
  std::string name;  // of the budget line: "sd_gap_mm"; "sd_part_mm[2]" where a key stands for several numbers
  double sd{};       // k = 1
  // The case with the quantity off by so many sd.
  std::function<void(Dataset&, double)> move;
  bool in_sd{};  // the method's own sd holds it already
};

// What the case states. Refuses: bad-config (no number above zero, as large as the quantity itself, a temperature or an
// expansion of another unit), missing-key (an uncertainty without its quantity).
Outcome<std::vector<TypeBInput>, Refusal> typeBInputs(const Dataset& dataset, StoreReader store = nullptr);

// The case with every known size of the method as it is at temperature_c, from its size at 20 degrees and
// expansion_per_k; unchanged without these keys.
Dataset atTemperature(const Dataset& dataset);

}  // namespace probebox::metrology
