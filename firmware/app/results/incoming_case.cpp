#include "firmware/app/results/incoming_case.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "protocol/messages/cases.hpp"

namespace probebox::app {
namespace {

Outcome<metrology::Value> valueOf(const messages::CaseEntry& entry) {
  const Error wrong{"The entry '" + entry.key + "' of the case has no value of its type."};
  const auto& numbers = entry.numbers;
  using Kind = messages::CaseValue;
  switch (entry.kind) {
    case Kind::flag:
      if (numbers.size() != 1) return wrong;
      return metrology::Value{numbers.front() != 0};
    case Kind::number:
      if (numbers.size() != 1) return wrong;
      return metrology::Value{numbers.front()};
    case Kind::text:
      return metrology::Value{entry.text};
    case Kind::numbers:
      return metrology::Value{numbers};
    case Kind::matrix: {
      if (entry.columns == 0 || numbers.size() % entry.columns != 0) return wrong;
      metrology::Matrix rows;
      for (std::size_t at = 0; at < numbers.size(); at += entry.columns) {
        const auto from = numbers.begin() + static_cast<std::ptrdiff_t>(at);
        rows.emplace_back(from, from + entry.columns);
      }
      return metrology::Value{std::move(rows)};
    }
  }
  return wrong;
}

// Memory that an entry, a column or a row of a matrix takes beside its content.
constexpr std::size_t kEntryBytes = 192;
constexpr std::size_t kColumnBytes = 192;
constexpr std::size_t kRowBytes = 48;

// Whoever proposes a case may write anything into it: traceable is only what the box measures itself on its sphere.
std::optional<Error> whyClaimed(const messages::CaseEntry& entry) {
  if (entry.key != "sphere_certificate" && entry.key != "sphere_next_due") return std::nullopt;
  return Error{
      "certificate-claimed: The case states '" + entry.key +
      "', which the box takes from its own runs alone, on the certified sphere of its unit.toml: remove it from "
      "config.json, or measure on this box (probebox calibrate)."};
}

std::size_t bytesOf(const messages::CaseEntry& entry) {
  const std::size_t rows = entry.columns == 0 ? 0 : entry.numbers.size() / entry.columns;
  return kEntryBytes + entry.key.size() + entry.text.size() + sizeof(double) * entry.numbers.size() + kRowBytes * rows;
}

// The one of that name, made when it is not there yet.
template <class Named>
Named& named(std::vector<Named>& all, const std::string& name, bool& is_new) {
  const auto found = std::ranges::find(all, name, &Named::name);
  is_new = found == all.end();
  if (!is_new) return *found;
  all.emplace_back().name = name;
  return all.back();
}

constexpr const char* kRemedy = "; leave out readings, or solve it on a computer (probebox solve).";

}  // namespace

Outcome<std::optional<metrology::Dataset>> IncomingCase::add(const messages::ProposeCase::Request& piece) {
  if (piece.first) {
    number_ = piece.number;
    bytes_ = 0;
    columns_ = 0;
    dataset_ = {};
    dataset_.method = piece.method;
  }
  if (number_ != piece.number) return Error{"The upload was interrupted by another case: send the whole case again."};
  if (auto error = append(piece)) {
    number_.reset();
    dataset_ = {};
    return *error;
  }
  if (!piece.last) return std::optional<metrology::Dataset>{};
  number_.reset();
  return std::optional{std::exchange(dataset_, {})};
}

std::optional<Error> IncomingCase::append(const messages::ProposeCase::Request& piece) {
  for (const auto& entry : piece.config) {
    if (auto error = whyClaimed(entry)) return error;
    bytes_ += bytesOf(entry);
    TRY(auto value, valueOf(entry));
    dataset_.config.insert_or_assign(entry.key, std::move(value));
  }
  for (const auto& part : piece.columns) {
    if (auto error = append(part)) return error;
  }
  if (bytes_ <= kMostBytes) return std::nullopt;
  return Error{"too-large: The case is too large for the box, which takes " + std::to_string(kMostBytes >> 20U) +
               " MB" + kRemedy};
}

std::optional<Error> IncomingCase::append(const messages::CaseColumn& part) {
  bool new_table = false;
  bool new_column = false;
  auto& table = named(dataset_.tables, part.table, new_table);
  auto& values = named(table.columns, part.column, new_column).values;
  values.insert(values.end(), part.values.begin(), part.values.end());
  bytes_ += sizeof(double) * part.values.size();
  if (new_table) bytes_ += kColumnBytes + part.table.size();
  if (new_column) {
    bytes_ += kColumnBytes + part.column.size();
    ++columns_;
  }
  if (columns_ > kMostColumns) {
    return Error{"too-many-columns: The case has more columns than the box takes (" + std::to_string(kMostColumns) +
                 ")" + kRemedy};
  }
  if (values.size() > kMostRows) {
    return Error{"too-many-rows: Table '" + part.table + "' has more rows than the box takes (" +
                 std::to_string(kMostRows) + ")" + kRemedy};
  }
  return std::nullopt;
}

}  // namespace probebox::app
