#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "firmware/corrections/snapshot.hpp"
#include "protocol/modbus/map.hpp"

namespace probebox::modbus {

// All registers as of one snapshot. Fixed size; filling allocates nothing.
class RegisterImage {
 public:
  RegisterImage();

  // A correction beyond +-3.2767 mm saturates in every format and sets `degraded`; one that is not a number keeps the
  // value that was served before, drops `valid` and sets `degraded`.
  void fill(const corrections::Snapshot& snapshot, WordOrder order);

  std::uint16_t operator[](std::uint16_t address) const { return image_[address]; }
  std::span<const std::uint16_t, kRegisterCount> registers() const { return image_; }

  // For what a line shows of its own: the registers that can be written.
  std::span<std::uint16_t, kRegisterCount> registers() { return image_; }

 private:
  void put(std::size_t address, double value);
  void putTriple(std::size_t address, const std::array<double, 3>& values, double factor);
  void putCorrections(const corrections::Snapshot& snapshot);
  void putDelay(const corrections::DelayInForce& delay);
  void putSources(const corrections::Snapshot& snapshot);
  void putCentreline(const corrections::CentrelineInForce& centreline);
  void putAxes(const corrections::Snapshot& snapshot);
  void putTrigger(const corrections::TriggerStamp& trigger);
  void putRotary(const corrections::Snapshot& snapshot);
  void putState(const corrections::Snapshot& snapshot);

  std::array<std::uint16_t, kRegisterCount> image_{};
  std::array<double, 3> served_mm_{};
  WordOrder order_{WordOrder::high_first};
};

}  // namespace probebox::modbus
