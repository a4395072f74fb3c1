#include "case_entry.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "firmware/json/dataset_json.hpp"
#include "firmware/json/result_json.hpp"
#include "firmware/metrology/solve.hpp"
#include "protocol/modbus/refusals.hpp"
#include "require.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/report/page.hpp"

namespace {

using namespace probebox;
using fuzz::require;
using metrology::Column;
using metrology::Dataset;
using metrology::Table;

const std::vector<Dataset>& cases() {
  static const std::vector<Dataset> all = [] {
    std::vector<std::filesystem::path> folders;
    for (const auto& entry : std::filesystem::directory_iterator{PROBEBOX_CASES}) folders.push_back(entry.path());
    std::ranges::sort(folders);
    std::vector<Dataset> read;
    for (const auto& folder : folders) {
      auto dataset = casefolder::readCase(folder);
      require(dataset.ok());
      read.push_back(std::move(*dataset));
    }
    return read;
  }();
  return all;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array kValues{0.0,  -0.0, 1.0,   -1.0,  1e-9, 1e-300,    1e9,        -1e9,
                             1e15, 1e19, 1e153, 1e308, kNaN, kInfinity, -kInfinity, 0.5};
constexpr std::array kFactors{
    0.0,   -1.0, 1000.0, 0.001,  180 / std::numbers::pi, std::numbers::pi / 180, 25.4, 2.0, 0.5, 1e6, 1e-6, 1.000001,
    1e100, 10.0, 0.1,    -1000.0};
constexpr std::array kSteps{1e-6, -1e-6, 1e-4, -1e-4, 0.01, -0.01, 1.0, -1.0, 100.0, -100.0, 1e6, 360.0};

struct Change {
  std::uint8_t kind, table, column, row_high, row_low, value;
};

template <class All>
auto& chosen(All& all, std::size_t k) {
  return all[k % std::size(all)];
}

// What a change is made to; null where the case has none.
struct Place {
  Table* table{};
  Column* column{};
  std::size_t row{};  // of the column

  Place(Dataset& dataset, const Change& change) {
    if (dataset.tables.empty()) return;
    table = &chosen(dataset.tables, change.table);
    if (table->columns.empty()) return;
    auto& found = chosen(table->columns, change.column);
    if (found.values.empty()) return;
    column = &found;
    row = (change.row_high * std::size_t{256} + change.row_low) % column->values.size();
  }
  double& cell() const { return column->values[row]; }
};

void changeCell(const Place& at, const Change& change) {
  switch (change.value % 3) {
    case 0:
      at.cell() = chosen(kValues, change.value / 3U);
      return;
    case 1:
      at.cell() *= chosen(kFactors, change.value / 3U);
      return;
    default:
      at.cell() += chosen(kSteps, change.value / 3U);
  }
}

void changeColumn(const Place& at, const Change& change) {
  auto& values = at.column->values;
  switch (change.value % 5) {
    case 0:
      for (auto& value : values) value *= chosen(kFactors, change.value / 5U);
      return;
    case 1:
      for (auto& value : values) value += chosen(kSteps, change.value / 5U);
      return;
    case 2:
      std::ranges::fill(values, at.cell());
      return;
    case 3:
      std::ranges::reverse(values);
      return;
    default:
      std::swap(at.column->values, chosen(at.table->columns, change.value / 5U).values);
  }
}

void changeRows(const Place& at, const Change& change) {
  for (auto& [name, values] : at.table->columns) {
    if (at.row >= values.size()) continue;
    const auto here = values.begin() + static_cast<std::ptrdiff_t>(at.row);
    switch (change.value % 5) {
      case 0:
        values.erase(here);
        break;
      case 1:
        values.insert(here, *here);
        break;
      case 2:
        std::iter_swap(here, values.begin() + change.value % static_cast<std::ptrdiff_t>(values.size()));
        break;
      case 3:
        values.resize(at.row);
        break;
      default:
        std::ranges::rotate(values, here);
    }
  }
}

void changeTables(Dataset& dataset, const Place& at, const Change& change) {
  switch (change.value % 4) {
    case 0:
      at.table->columns.erase(at.table->columns.begin() + (at.column - at.table->columns.data()));
      return;
    case 1:
      dataset.tables.erase(dataset.tables.begin() + (at.table - dataset.tables.data()));
      return;
    case 2:
      at.table->columns.push_back(*at.column);
      return;
    default:
      at.column->values.pop_back();  // no longer as long as the others
  }
}

void changeConfig(Dataset& dataset, const Change& change) {
  if (dataset.config.empty()) return;
  auto key = dataset.config.begin();
  std::advance(key, static_cast<std::ptrdiff_t>(change.column % dataset.config.size()));
  const double value = chosen(kValues, change.row_low);
  switch (change.value % 6) {
    case 0:
      dataset.config.erase(key);
      return;
    case 1:
      key->second = value;
      return;
    case 2:
      if (auto* number = std::get_if<double>(&key->second)) *number *= chosen(kFactors, change.row_low);
      return;
    case 3:
      key->second = std::string{"<b>\x1b[2J"};
      return;
    case 4:
      key->second = std::vector<double>(change.row_high % 5U, value);
      return;
    default:
      key->second = metrology::Matrix(change.row_high % 4U, std::vector<double>(change.row_low % 4U, value));
  }
}

void apply(const Change& change, Dataset& dataset) {
  if (change.kind % 8 == 6) return changeConfig(dataset, change);
  if (change.kind % 8 == 7) {
    if (change.value % 4 == 0) dataset.method = chosen(cases(), change.row_low).method;
    return;
  }
  const Place at{dataset, change};
  if (at.column == nullptr) return;
  switch (change.kind % 8) {
    case 0:
    case 1:
    case 2:
      return changeCell(at, change);
    case 3:
      return changeColumn(at, change);
    case 4:
      return changeRows(at, change);
    default:
      return changeTables(dataset, at, change);
  }
}

bool isASentence(const std::string& text) {
  constexpr std::size_t kLongest = 3000;
  return !text.empty() && text.size() <= kLongest &&
         std::ranges::none_of(text, [](unsigned char c) { return c != '\n' && std::iscntrl(c) != 0; });
}

bool isFinite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}
bool isAnSd(const std::vector<double>& values) {
  return isFinite(values) && std::ranges::all_of(values, [](double value) { return value >= 0; });
}

void lookAt(const metrology::Result& result) {
  require(!result.estimates.empty());
  for (const auto* all : {&result.estimates, &result.also}) {
    for (const auto& estimate : *all) {
      require(isFinite(estimate.values) && isAnSd(estimate.sd) && isAnSd(estimate.uncertainty), estimate.key);
      require(estimate.sd.empty() || estimate.sd.size() == estimate.values.size());
    }
  }
  require(std::isfinite(result.rms) && result.rms >= 0);
  require(!result.chi2_reduced || (std::isfinite(*result.chi2_reduced) && *result.chi2_reduced >= 0));
  require(!result.covariance || isFinite(result.covariance->values));
  for (const auto& warning : result.warnings) require(isASentence(warning), warning);
  for (const auto& dropped : result.dropped) require(isASentence(dropped.name) && isASentence(dropped.reason));
  const auto again = json::resultFromJson(json::toJson(result));
  require(again && again->estimates == result.estimates && again->warnings == result.warnings);
}

}  // namespace

int feedCase(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kChange = 6, kMostChanges = 8;
  if (size < 1) return 0;
  fuzz::feeding({data, size});
  Dataset dataset = chosen(cases(), data[0]);
  const auto changes = std::min((size - 1) / kChange, kMostChanges);
  for (std::size_t k = 0; k < changes; ++k) {
    const auto* at = data + 1 + k * kChange;
    apply({at[0], at[1], at[2], at[3], at[4], at[5]}, dataset);
  }
  // The daemon gets it as text.
  const auto told = json::datasetFromJson(json::toJson(dataset));
  require(told.ok(), told ? "" : told.error().what);
  const auto solved = metrology::solve(*told);
  report::Subject subject{.name = "case", .method = dataset.method, .dataset = *told, .answer = metrology::Refusal{}};
  if (solved) {
    lookAt(*solved);
    subject.answer = *solved;
  } else {
    require(modbus::codeOfRefusal(solved.error().name) != modbus::refusal::not_in_list, solved.error().name);
    require(isASentence(solved.error().reason), solved.error().reason);
    subject.answer = solved.error();
  }
  const auto page = report::page(std::span{&subject, 1}, "test");
  require(page.find("<b>\x1b") == std::string::npos);
  return 0;
}
