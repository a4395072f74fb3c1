#include "firmware/app/results/incoming_case.hpp"

#include <algorithm>
#include <string>
#include <utility>

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

// The one of that name, made when it is not there yet.
template <class Named>
Named& named(std::vector<Named>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  if (found != all.end()) return *found;
  all.emplace_back().name = name;
  return all.back();
}

}  // namespace

Outcome<std::optional<metrology::Dataset>> IncomingCase::add(const messages::ProposeCase::Request& piece) {
  if (piece.first) {
    number_ = piece.number;
    numbers_ = 0;
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
    auto value = valueOf(entry);
    if (!value) return value.error();
    numbers_ += entry.numbers.size() + (entry.key.size() + entry.text.size()) / sizeof(double);
    dataset_.config.insert_or_assign(entry.key, std::move(*value));
  }
  for (const auto& part : piece.columns) {
    auto& values = named(named(dataset_.tables, part.table).columns, part.column).values;
    values.insert(values.end(), part.values.begin(), part.values.end());
    numbers_ += part.values.size() + (part.table.size() + part.column.size()) / sizeof(double);
  }
  if (numbers_ <= kMostNumbers) return std::nullopt;
  return Error{"The case is too large for the box: it takes " + std::to_string(kMostNumbers) + " numbers."};
}

}  // namespace probebox::app
