#include "firmware/metrology/dataset/method.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/read_times.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology {

namespace {

// From 1 on.
std::optional<std::uint32_t> statedNumber(const Dataset& dataset, std::string_view key) {
  const auto found = dataset.config.find(key);
  const auto* number = found == dataset.config.end() ? nullptr : std::get_if<double>(&found->second);
  const bool is_one = number != nullptr && *number >= 1 && *number < std::numeric_limits<std::uint32_t>::max();
  return is_one ? std::optional{static_cast<std::uint32_t>(std::llround(*number))} : std::nullopt;
}

}  // namespace

bool hasSize(const Method& method) {
  return std::ranges::any_of(method.known, [](const KnownQuantity& known) { return known.kind == KnownKind::size; });
}

MethodColumn columnOf(const Method& method, std::string_view table, std::string_view column) {
  if (column == column::kReadAt.name) return column::kReadAt;
  MethodColumn elsewhere{column};
  for (const auto& described : method.tables) {
    const auto found = std::ranges::find(described.columns, column, &MethodColumn::name);
    if (found == described.columns.end()) continue;
    if (described.name == table) return *found;
    elsewhere = *found;
  }
  const bool is_described = std::ranges::find(method.tables, table, &MethodTable::name) != method.tables.end();
  return is_described ? MethodColumn{column} : elsewhere;
}

const Quantity* quantityOf(const Method& method, std::string_view key) {
  for (const auto& listed : {method.results, method.further}) {
    const auto found = std::ranges::find_if(listed, [key](const Quantity& each) { return each.names(key); });
    if (found != listed.end()) return &*found;
  }
  return nullptr;
}

Table emptyTable(const Method& method, std::string_view table, const ColumnNames& also) {
  std::vector<std::string_view> names;
  const auto described = std::ranges::find(method.tables, table, &MethodTable::name);
  if (described == method.tables.end()) return Table::withColumns(std::string{table}, also);
  for (const auto& column : described->columns) {
    const bool is_wanted = std::ranges::find(also, column.name) != also.end();
    if (column.may_be != MayBe::missing || is_wanted) names.push_back(column.name);
  }
  return Table::withColumns(std::string{table}, names);
}

std::vector<std::string_view> typeBKeys(const Method& method) {
  std::vector<std::string_view> keys;
  for (const auto& known : method.known) {
    if (std::ranges::find(keys, known.sd_key) == keys.end()) keys.push_back(known.sd_key);
  }
  if (hasSize(method)) keys.insert(keys.end(), std::begin(kTemperatureKeys), std::end(kTemperatureKeys));
  return keys;
}

std::string unusedKey(std::string_view key, std::string_view method) {
  return "config key '" + std::string{key} + "' is not used by method " + std::string{method};
}

std::vector<std::string> unusedKeys(const Dataset& dataset, const Method& method) {
  const auto type_b = typeBKeys(method);
  std::vector<std::string> sentences;
  constexpr std::size_t kMostNamed = 20;
  std::size_t unused = 0;
  for (const auto& [key, value] : dataset.config) {
    const bool used = std::ranges::find(method.keys, key, &MethodKey::name) != method.keys.end() ||
                      std::ranges::find(type_b, key) != type_b.end();
    if (used || isCondition(key) || isMachineError(key) || key == kReadingTime) continue;
    if (++unused <= kMostNamed) sentences.push_back(unusedKey(key, dataset.method));
  }
  if (unused > kMostNamed) {
    sentences.push_back("and " + std::to_string(unused - kMostNamed) + " more config keys are not used by method " +
                        dataset.method);
  }
  return sentences;
}

std::optional<SubjectKind> subjectNamedBy(std::string_view key, const Method& method) {
  const auto own = std::ranges::find(method.keys, key, &MethodKey::name);
  return own != method.keys.end() ? own->names : subjectNamedByCondition(key);
}

std::optional<Subject> numberedSubject(const Dataset& dataset, SubjectKind kind, std::string_view key) {
  const auto number = statedNumber(dataset, key);
  return number ? std::optional{Subject{kind, *number}} : std::nullopt;
}

std::uint32_t probeToolOf(const Dataset& dataset) {
  return statedNumber(dataset, "probe_tool").value_or(1);
}

std::string stylusOffsetSubject(std::uint32_t tool) {
  return text(Subject{SubjectKind::stylus_offset, tool});
}

std::optional<Subject> letteredSubject(const Dataset& dataset, SubjectKind kind) {
  const auto found = dataset.config.find("axis");
  const auto* axis = found == dataset.config.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (axis == nullptr || axis->size() != 1) return std::nullopt;
  auto name = text(aboutAxis(kind, 0));
  name.back() = static_cast<char>(std::tolower(static_cast<unsigned char>(axis->front())));
  return parseSubject(name, kind);
}

}  // namespace probebox::metrology
