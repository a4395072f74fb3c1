#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/messages/cases.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Assembles a case that a host sends in pieces. For the worker's thread.
class IncomingCase {
 public:
  // Limits: above the needs of any method, and low enough for a small box, which also keeps the case as text.
  static constexpr std::size_t kMostBytes = 8U << 20U;  // of memory: numbers, names, text, and their containers
  static constexpr std::size_t kMostRows = 250'000;     // of one table
  static constexpr std::size_t kMostColumns = 256;      // of all tables

  // Adds a piece; returns the case after its last piece, nothing before. Errors discard the case: too-large,
  // too-many-rows, too-many-columns, certificate-claimed (it states the certificate of a sphere).
  Outcome<std::optional<metrology::Dataset>> add(const messages::ProposeCase::Request& piece);

 private:
  std::optional<Error> append(const messages::ProposeCase::Request& piece);
  std::optional<Error> append(const messages::CaseColumn& part);

  std::optional<std::uint32_t> number_;  // of the case that is being received
  metrology::Dataset dataset_;
  std::size_t bytes_{};
  std::size_t columns_{};
};

}  // namespace probebox::app
