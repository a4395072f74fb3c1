#include "firmware/metrology/uncertainty/known_quantities.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/pre_travel_shifts.hpp"
#include "firmware/metrology/dataset/stamp_digits.hpp"
#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kReference_c = 20.0;       // ISO 1
constexpr double kLargestExpansion = 1e-3;  // per K; zinc has 3e-5

double* numberIn(Dataset& dataset, std::string_view key, std::size_t part) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return nullptr;
  if (auto* list = std::get_if<std::vector<double>>(&entry->second)) {
    return part < list->size() ? &(*list)[part] : nullptr;
  }
  return part == 0 ? std::get_if<double>(&entry->second) : nullptr;
}

// Multiplies every known size of the method.
void scaleSizes(Dataset& dataset, std::span<const KnownQuantity> quantities, double factor) {
  for (const auto& known : quantities) {
    if (known.kind != KnownKind::size) continue;
    for (std::size_t part = 0; double* size = numberIn(dataset, known.key, part); ++part) *size *= factor;
  }
}

struct Temperature {
  double above_k{};  // the reference
  double expansion_per_k{};
};

// Nothing where the case states none that matters. Refuses what typeBInputs does of it.
Outcome<std::optional<Temperature>, Refusal> temperatureOf(const Dataset& dataset, const Method& method) {
  TRY(const auto celsius, configNumber(dataset, "temperature_c"));
  if (celsius && (*celsius < kColdest_c || *celsius > kWarmest_c)) {
    return Refusal{"bad-config", "config key 'temperature_c' is " + text(*celsius) +
                                     ": give degrees Celsius, from -30 to 70, at which it was measured"};
  }
  if (!hasSize(method)) return std::optional<Temperature>{};
  TRY(const auto expansion, configNumber(dataset, "expansion_per_k"));
  if (expansion && std::abs(*expansion) > kLargestExpansion) {
    return Refusal{"bad-config", "config key 'expansion_per_k' is " + text(*expansion) +
                                     ": give the relative expansion of the piece per kelvin, such as 11.5e-6"};
  }
  for (const auto key : kTemperatureKeys) {
    if (!dataset.config.contains(key) || (celsius && expansion)) continue;
    return Refusal{"missing-key",
                   "config key '" + std::string{key} + "' needs temperature_c and expansion_per_k as well"};
  }
  if (!expansion) return std::optional<Temperature>{};
  return std::optional{Temperature{*celsius - kReference_c, *expansion}};
}

std::optional<Refusal> addTemperature(std::vector<TypeBInput>& inputs, const Dataset& dataset, const Method& method) {
  TRY(const auto temperature, temperatureOf(dataset, method));
  if (!temperature) return std::nullopt;
  const auto [above, expansion] = *temperature;
  const double now = 1.0 + expansion * above;
  const auto add = [&](std::string_view key, double per_unit) -> std::optional<Refusal> {
    TRY(const auto sd, configPositive(dataset, key));
    if (!sd) return std::nullopt;
    const double share = per_unit * *sd / now;
    inputs.push_back({std::string{key}, *sd, [share, sizes = method.known](Dataset& moved, double by) {
                        scaleSizes(moved, sizes, 1 + share * by);
                      }});
    return std::nullopt;
  };
  if (auto refusal = add("sd_temperature_k", expansion)) return refusal;
  return add("sd_expansion_per_k", above);
}

Refusal tooUncertain(std::string_view sd_key, double sd, std::string_view key) {
  return {"bad-config", "config key '" + std::string{sd_key} + "' is " + text(sd) + ", as large as " +
                            std::string{key} + " itself: give its standard uncertainty (k = 1) in the same unit"};
}

TypeBInput cellInput(std::string_view sd_key, std::string_view table, std::string_view column, std::size_t row,
                     double sd) {
  const auto move = [=](Dataset& moved, double by) {
    for (auto& changed : moved.tables) {
      const auto found = std::ranges::find(changed.columns, column, &Column::name);
      if (changed.name == table && found != changed.columns.end()) found->values[row] += by * sd;
    }
  };
  return {std::string{sd_key}, sd, move};
}

void addTable(std::vector<TypeBInput>& inputs, const KnownQuantity& known, const Dataset& dataset, double sd) {
  const Table* table = dataset.table(known.key);
  for (std::size_t row = 0; table != nullptr && row < table->rows(); ++row) {
    for (const auto coordinate : column::kPosition) {
      inputs.push_back(cellInput(known.sd_key, known.key, coordinate, row, sd));
      inputs.back().in_sd = known.in_sd;
    }
  }
}

// One error of all cells: they come from one certificate.
bool addColumn(std::vector<TypeBInput>& inputs, const KnownQuantity& known, const Dataset& dataset, double sd) {
  const auto has = [&](const Table& table) { return table.column(known.key) != nullptr; };
  if (std::ranges::none_of(dataset.tables, has)) return false;
  const auto move = [key = known.key, sd](Dataset& moved, double by) {
    for (auto& changed : moved.tables) {
      const auto found = std::ranges::find(changed.columns, key, &Column::name);
      if (found == changed.columns.end()) continue;
      for (double& value : found->values) value += by * sd;
    }
  };
  inputs.push_back({std::string{known.sd_key}, sd, move, known.in_sd});
  return true;
}

// Readings that the quantity moves.
std::optional<Refusal> addMoves(std::vector<TypeBInput>& inputs, const KnownQuantity& known, const Dataset& dataset,
                                double sd, MovedBy moved_by) {
  auto moves = moved_by(dataset, known.sd_key);
  if (moves.empty()) {
    return Refusal{"missing-key", "config key '" + std::string{known.sd_key} +
                                      "' is stated, but the readings have no " + std::string{known.key} +
                                      " of that number: omit it"};
  }
  inputs.push_back(movedInput(known.sd_key, sd, std::move(moves)));
  inputs.back().in_sd = known.in_sd;
  return std::nullopt;
}

// A length that a store holds has its sd there too.
void addStored(std::vector<TypeBInput>& inputs, const KnownQuantity& known, const Dataset& dataset, StoreReader store) {
  const auto stored = known.in_sd && store != nullptr ? store(dataset, known.key) : std::nullopt;
  if (!stored) return;
  inputs.push_back(cellInput(known.sd_key, stored->table, stored->column, stored->row, stored->sd));
  inputs.back().in_sd = true;
}

std::optional<Refusal> addKnown(std::vector<TypeBInput>& inputs, const KnownQuantity& known, const Dataset& dataset,
                                const Method& method, StoreReader store) {
  TRY(const auto sd, configPositive(dataset, known.sd_key));
  if (!sd) {
    addStored(inputs, known, dataset, store);
    return std::nullopt;
  }
  if (known.kind == KnownKind::table) {
    addTable(inputs, known, dataset, *sd);
    return std::nullopt;
  }
  if (known.kind == KnownKind::moves) return addMoves(inputs, known, dataset, *sd, method.moved_by);
  if (known.kind == KnownKind::column && addColumn(inputs, known, dataset, *sd)) return std::nullopt;
  Dataset looked_at{.method = dataset.method, .config = dataset.config, .tables = {}};
  if (numberIn(looked_at, known.key, 0) == nullptr) {
    if (known.in_sd) return std::nullopt;  // the method refuses what it needs, and only that
    return Refusal{"missing-key", "config key '" + std::string{known.sd_key} + "' is stated without '" +
                                      std::string{known.key} + "', the value that it belongs to: state both"};
  }
  for (std::size_t part = 0; const double* value = numberIn(looked_at, known.key, part); ++part) {
    if (known.kind == KnownKind::size && !(*sd < std::abs(*value))) return tooUncertain(known.sd_key, *sd, known.key);
    const auto move = [key = known.key, part, width = *sd](Dataset& moved, double by) {
      if (double* number = numberIn(moved, key, part)) *number += by * width;
    };
    inputs.push_back({std::string{known.sd_key}, *sd, move, known.in_sd});
  }
  return std::nullopt;
}

// Changes a whole case by what one sd of one cause changes it by. stop: of that stop alone, in tables that number them.
TypeBInput shiftInput(const std::string& suffix, std::string_view name, bool widens,
                      std::optional<double> stop = std::nullopt) {
  const auto move = [suffix, stop](Dataset& moved, double by) {
    for (auto& changed : moved.tables) {
      const Table* shift = moved.table(changed.name + suffix);
      if (shift == nullptr) continue;
      const auto* stops = shift->column(kOfStop);
      if ((stops != nullptr) != stop.has_value()) continue;
      for (auto& column : changed.columns) {
        const auto* by_one_sd = shift->column(column.name);
        if (by_one_sd == nullptr || by_one_sd->empty()) continue;
        const bool alike = by_one_sd->size() == 1;  // one row is of all
        const std::size_t rows = alike ? column.values.size() : std::min(by_one_sd->size(), column.values.size());
        for (std::size_t row = 0; row < rows; ++row) {
          if (stops != nullptr && (*stops)[alike ? 0 : row] != *stop) continue;
          column.values[row] += by * (*by_one_sd)[alike ? 0 : row];
        }
      }
    }
  };
  return {.name = std::string{name}, .sd = 1, .move = move, .in_sd = false, .widens = widens};
}

std::set<double> stopsIn(const Dataset& dataset, const std::string& suffix) {
  std::set<double> stops;
  for (const auto& table : dataset.tables) {
    const auto* numbers = table.name.ends_with(suffix) ? table.column(kOfStop) : nullptr;
    if (numbers != nullptr) stops.insert(numbers->begin(), numbers->end());
  }
  return stops;
}

// A cause that changes nothing in this case has no table, so numbers may be missing.
void addShifts(std::vector<TypeBInput>& inputs, const Dataset& dataset) {
  std::set<std::string> suffixes;
  for (const auto& table : dataset.tables) {
    if (const auto at = table.name.find(kByPreTravel); at != std::string::npos) suffixes.insert(table.name.substr(at));
  }
  for (const auto& suffix : suffixes) inputs.push_back(shiftInput(suffix, kPreTravelBudget, false));
  for (const auto& axis : kStandingAxes) {
    const std::string suffix{axis.suffix};
    const auto isOfOne = [&](const Table& t) { return t.name.ends_with(suffix) && t.column(kOfStop) == nullptr; };
    if (std::ranges::any_of(dataset.tables, isOfOne)) inputs.push_back(shiftInput(suffix, axis.budget, true));
    for (const double stop : stopsIn(dataset, suffix)) inputs.push_back(shiftInput(suffix, axis.budget, true, stop));
  }
}

void addStampDigits(std::vector<TypeBInput>& inputs, const Dataset& dataset) {
  for (const auto& stamps : coarseStamps(dataset)) {
    const double sd_s = stamps.sd_s();
    const auto move = [table = stamps.table, sd_s](Dataset& moved, double by) {
      const auto changed = std::ranges::find(moved.tables, table, &Table::name);
      for (double& time_s : std::ranges::find(changed->columns, column::kTime.name, &Column::name)->values)
        time_s += by * sd_s;
    };
    inputs.push_back({.name = std::string{kStampDigitsBudget},
                      .sd = sd_s,
                      .move = move,
                      .widens = true,
                      .warning = sentenceOf(stamps)});
  }
}

}  // namespace

TypeBInput movedInput(std::string_view name, double sd, std::vector<Table> by_one) {
  const auto move = [by_one = std::move(by_one), sd](Dataset& moved, double by) {
    for (const auto& of_table : by_one) {
      for (auto& changed : moved.tables) {
        for (auto& column : changed.columns) {
          const auto* change = changed.name == of_table.name ? of_table.column(column.name) : nullptr;
          for (std::size_t row = 0; change != nullptr && row < change->size(); ++row)
            column.values[row] += by * sd * (*change)[row];
        }
      }
    }
  };
  return {.name = std::string{name}, .sd = sd, .move = move};
}

Outcome<std::vector<TypeBInput>, Refusal> typeBInputs(const Dataset& dataset, const Method& method, StoreReader store) {
  std::vector<TypeBInput> inputs;
  for (const auto& known : method.known) {
    if (auto refusal = addKnown(inputs, known, dataset, method, store)) return *refusal;
  }
  if (auto refusal = addTemperature(inputs, dataset, method)) return *refusal;
  addShifts(inputs, dataset);
  addStampDigits(inputs, dataset);
  return inputs;
}

bool isWarm(const Dataset& dataset) {
  return dataset.config.contains("expansion_per_k");
}

Dataset atTemperature(const Dataset& dataset, const Method& method) {
  Dataset warm = dataset;
  const auto temperature = temperatureOf(dataset, method);
  if (temperature && temperature.value()) {
    scaleSizes(warm, method.known, 1.0 + (*temperature)->expansion_per_k * (*temperature)->above_k);
  }
  return warm;
}

}  // namespace probebox::metrology
