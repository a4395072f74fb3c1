#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The cell of a store that replaces a config key, and its sd.
struct StoredLength {
  std::string_view table;
  std::string_view column;
  std::size_t row{};
  double sd{};
};
// Finds that cell; nullopt when no store replaces the key or its sd is zero.
using StoreReader = std::optional<StoredLength> (*)(const Dataset& dataset, std::string_view key);

// A quantity that the measurement relies on and cannot determine: a certificate, a temperature.
struct TypeBInput {
  std::string name;  // name of the budget line: "sd_gap_mm"; "sd_part_mm[2]" if a key holds several numbers
  double sd{};       // k = 1
  // Changes the quantity in the case by this many sd.
  std::function<void(Dataset&, double)> move;
  bool in_sd{};   // included in the method's own sd
  bool widens{};  // not included there, and to be: common to all readings, whose residuals do not show it
  // Of the machine's own errors: moved one way only, and left out, with a warning, where the solver refuses that.
  bool of_machine{};
  bool is_assumed{};      // the case does not state it
  bool whole_step{};      // moved by a whole sd
  std::string warning{};  // of an input that nobody has stated: it counts, and is told, where it is a tenth of an sd
  // In place of `move`: by what one sd moves what was read at each touch of Result::touched outwards, mm.
  std::vector<double> outwards_mm{};
};

// An input that moves columns of the tables of the case, row by row; by_one: by what one unit of the quantity moves
// them.
TypeBInput movedInput(std::string_view name, double sd, std::vector<Table> by_one);

// Type B inputs stated in the case. Refuses: bad-config (not above zero, as large as the quantity itself, wrong unit of
// temperature or expansion), missing-key (an uncertainty without its quantity).
Outcome<std::vector<TypeBInput>, Refusal> typeBInputs(const Dataset& dataset, const Method& method,
                                                      StoreReader store = nullptr);

// Whether sizes of the case are converted to a temperature of their own.
bool isWarm(const Dataset& dataset);

// Converts every known size of the method from 20 degrees to temperature_c by expansion_per_k; unchanged without these
// keys.
Dataset atTemperature(const Dataset& dataset, const Method& method);

}  // namespace probebox::metrology
