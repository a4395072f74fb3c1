#include "firmware/metrology/tool/tool_store.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

struct Store {
  std::string_view table;
  std::span<const MethodColumn, 3> columns;  // id, length and sd
  std::string_view sd;                       // key that the row's sd_mm stands for

  std::string_view id() const { return columns[0]; }
  std::string_view length() const { return columns[1]; }
};
constexpr std::array<Store, 2> kStores{
    {{"holder_store", kHolderColumns, "sd_L1_mm"}, {"tool_store", kToolColumns, "sd_L2_mm"}}};

bool hasStores(const Dataset& dataset) {
  return dataset.table(kStores[0].table) || dataset.table(kStores[1].table);
}

// The row of an id. Refuses: missing-id, duplicated-id.
Outcome<std::size_t, Refusal> rowOf(const Table& table, const Store& store, double id) {
  const auto& ids = *table.column(store.id());
  std::optional<std::size_t> found;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (ids[row] != id) continue;
    if (found) {
      return Refusal{"duplicated-id", "table '" + table.name + "' has " + std::string{store.id()} + " " + text(id) +
                                          " twice: keep the row with the right length"};
    }
    found = row;
  }
  if (found) return *found;
  return Refusal{"missing-id", "table '" + table.name + "' has no " + std::string{store.id()} + " " + text(id) +
                                   ": measure it and store its length first"};
}

std::optional<Refusal> fillFrom(const Store& store, const Dataset& dataset, Dataset& filled) {
  if (!dataset.table(store.table)) return std::nullopt;
  TRY(const auto table, checkedTable(dataset, store.table, store.columns));
  TRY(const auto id, configNumber(dataset, store.id()));
  if (!id) {
    return Refusal{"missing-id", "config.json has no key '" + std::string{store.id()} + "': name the row of table '" +
                                     std::string{store.table} + "', a number"};
  }
  for (const auto key : {store.length(), store.sd}) {
    if (dataset.config.contains(key)) {
      return Refusal{"bad-config", "config key '" + std::string{key} + "' is given together with table '" +
                                       std::string{store.table} + "': keep only one of the two"};
    }
  }
  TRY(const auto row, rowOf(*table, store, *id));
  filled.config[std::string{store.length()}] = (*table->column(store.length()))[row];
  const double sd = (*table->column(kStoredSd))[row];
  if (sd != 0.0) filled.config[std::string{store.sd}] = sd;
  return std::nullopt;
}

}  // namespace

Outcome<Dataset, Refusal> withStoredLengths(const Dataset& dataset) {
  Dataset filled = dataset;
  for (const auto& store : kStores) {
    if (auto refusal = fillFrom(store, dataset, filled)) return *refusal;
  }
  if (!hasStores(dataset)) return filled;
  for (const std::string_view key : {"holder_id", "tool_id", "measured_at_s"}) {
    TRY(requiredNumber(dataset, key));
  }
  return filled;
}

std::optional<StoredLength> storedLength(const Dataset& dataset, std::string_view key) {
  const auto store = std::ranges::find(kStores, key, &Store::length);
  if (store == kStores.end() || !dataset.table(store->table) || !withStoredLengths(dataset)) return std::nullopt;
  const Table& table = *dataset.table(store->table);
  const auto row = rowOf(table, *store, *configNumber(dataset, store->id()).value());
  const double sd = (*table.column(kStoredSd))[*row];
  if (!(sd > 0.0)) return std::nullopt;
  return StoredLength{store->table, store->length(), *row, sd};
}

void addStoreRecords(Result& result, const Dataset& dataset) {
  if (!hasStores(dataset)) return;
  const Estimate length = *result.find(quantity::kAssembledLength);
  const Estimate compensation = *result.find(quantity::kCompensation);
  // (C3): in X and Y both records hold the same.
  Estimate motion = Estimate::vector("motion_control_mm", compensation.values, compensation.sd);
  Estimate simulation = Estimate::vector("simulation_mm", compensation.values, compensation.sd);
  simulation.values[2] = length.value();
  if (!simulation.sd.empty()) simulation.sd[2] = length.sd.empty() ? 0.0 : length.sd[0];
  result.also.push_back(std::move(motion));
  result.also.push_back(std::move(simulation));
  for (const std::string_view key : {"tool_id", "holder_id", "measured_at_s"}) {
    const double value = requiredNumber(dataset, key).value();
    result.also.push_back(Estimate::scalar(std::string{key}, value, std::nullopt));
  }
}

}  // namespace probebox::metrology
