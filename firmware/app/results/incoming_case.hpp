#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/messages/cases.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// A case that a host sends in pieces, put together. On the worker's thread.
class IncomingCase {
 public:
  // Each more than a case of any method has, and little enough for a small box, which keeps the case as text too.
  static constexpr std::size_t kMostBytes = 8U << 20U;  // of memory: numbers, names, text, and what holds each of them
  static constexpr std::size_t kMostRows = 250'000;     // of one table
  static constexpr std::size_t kMostColumns = 256;      // of all tables

  // The whole case with its last piece, nothing before it. An error forgets all of it: too-large, too-many-rows,
  // too-many-columns.
  Outcome<std::optional<metrology::Dataset>> add(const messages::ProposeCase::Request& piece);

 private:
  std::optional<Error> append(const messages::ProposeCase::Request& piece);
  std::optional<Error> append(const messages::CaseColumn& part);

  std::optional<std::uint32_t> number_;  // of the case that is on its way
  metrology::Dataset dataset_;
  std::size_t bytes_{};
  std::size_t columns_{};
};

}  // namespace probebox::app
