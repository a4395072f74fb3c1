#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// A case that a host sends in pieces, put together. On the worker's thread.
class IncomingCase {
 public:
  // More numbers than the largest case of the methods has, and few enough for a small box. Eight letters count as one.
  static constexpr std::size_t kMostNumbers = 2'000'000;

  // The whole case with its last piece, nothing before it. An error forgets all of it.
  Outcome<std::optional<metrology::Dataset>> add(const messages::ProposeCase::Request& piece);

 private:
  std::optional<Error> append(const messages::ProposeCase::Request& piece);

  std::optional<std::uint32_t> number_;  // of the case that is on its way
  metrology::Dataset dataset_;
  std::size_t numbers_{};
};

}  // namespace probebox::app
