#pragma once
#include <array>
#include <cstdint>
#include <span>

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

  std::array<std::uint16_t, kRegisterCount> image_{};
  std::array<double, 3> served_mm_{};
  WordOrder order_{WordOrder::high_first};
};

}  // namespace probebox::modbus
