#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "protocol/modbus/map.hpp"
#include "protocol/state/served_results.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::modbus {

// Holds all registers for one snapshot, each as its line of the map says. fill() does not allocate.
class RegisterImage {
 public:
  RegisterImage();

  using Results = std::shared_ptr<const published::ServedResults>;
  // A correction beyond +-3.2767 mm saturates in every format and sets `degraded`. NaN or infinity keeps the previous
  // value, clears `valid` and sets `degraded`. Values of results are converted only when these or the word order have
  // changed.
  void fill(const published::Snapshot& snapshot, const published::LineState& line, const Results& results,
            WordOrder order);

  std::uint16_t operator[](std::uint16_t address) const { return image_[address]; }
  std::span<const std::uint16_t, kRegisterCount> registers() const { return image_; }

  // Mutable registers, for the values that belong to one line: those that can be written.
  std::span<std::uint16_t, kRegisterCount> registers() { return image_; }

 private:
  void put(std::size_t address, double value);
  // Takes the corrections that are to be served; returns the status word.
  std::uint16_t serve(const published::Snapshot& snapshot);
  void putResults(const published::ServedResults& results);

  std::array<std::uint16_t, kRegisterCount> image_{};
  std::array<double, 3> served_mm_{};
  WordOrder order_{WordOrder::high_first};
  Results shown_;
  WordOrder shown_in_{};
};

}  // namespace probebox::modbus
