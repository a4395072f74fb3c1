#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Assembles a case that a host sends in pieces. On the worker's thread.
class IncomingCase {
 public:
  // More numbers than the largest case of any method, and few enough for a small box. Eight letters count as one
  // number.
  static constexpr std::size_t kMostNumbers = 2'000'000;

  // Returns the whole case with its last piece, nullopt before. An error discards all pieces.
  Outcome<std::optional<metrology::Dataset>> add(const messages::ProposeCase::Request& piece);

 private:
  std::optional<Error> append(const messages::ProposeCase::Request& piece);

  std::optional<std::uint32_t> number_;  // number of the case being received
  metrology::Dataset dataset_;
  std::size_t numbers_{};
};

}  // namespace probebox::app
