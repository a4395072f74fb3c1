#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "firmware/published/served_results.hpp"
#include "firmware/published/snapshot.hpp"
#include "protocol/modbus/map.hpp"

namespace probebox::modbus {

// Holds all registers for one snapshot. fill() does not allocate.
class RegisterImage {
 public:
  RegisterImage();

  // A correction beyond +-3.2767 mm saturates in every format and sets `degraded`. NaN or infinity keeps the previous
  // value, clears `valid` and sets `degraded`.
  void fill(const published::Snapshot& snapshot, WordOrder order);

  // The same with the state of the line and results, which are converted only when they or the word order have changed.
  using Results = std::shared_ptr<const published::ServedResults>;
  void fill(const published::Snapshot& snapshot, const published::LineState& line, const Results& results,
            WordOrder order);

  std::uint16_t operator[](std::uint16_t address) const { return image_[address]; }
  std::span<const std::uint16_t, kRegisterCount> registers() const { return image_; }

  // Mutable registers, for the values that belong to one line: those that can be written.
  std::span<std::uint16_t, kRegisterCount> registers() { return image_; }

 private:
  void put(std::size_t address, double value);
  void putTriple(std::size_t address, const std::array<double, 3>& values, double factor);
  void putCorrections(const published::Snapshot& snapshot);
  void putDelay(const published::DelayInForce& delay);
  void putSources(const published::Snapshot& snapshot);
  void putCentreline(const published::CentrelineInForce& centreline);
  void putAxes(const published::Snapshot& snapshot);
  void putTrigger(const published::TriggerStamp& trigger);
  void putRotary(const published::Snapshot& snapshot);
  void putState(const published::Snapshot& snapshot);
  void putLine(const published::LineState& line);
  void putStep(const published::Snapshot& snapshot, const published::KnownFeatures& features);
  void putScan(const ScanPath& scan, double reach_mm);
  void putResults(const published::ServedResults& results);
  void putSlide(const published::Snapshot& snapshot, const published::ServedResults& results);

  std::array<std::uint16_t, kRegisterCount> image_{};
  std::array<double, 3> served_mm_{};
  WordOrder order_{WordOrder::high_first};
  Results shown_;
  WordOrder shown_in_{};
};

}  // namespace probebox::modbus
