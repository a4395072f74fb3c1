#pragma once
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "drivers/world/box_link.hpp"
#include "protocol/modbus/map.hpp"

namespace probebox::scenario {

// What a Modbus master can do.
struct Registers {
  std::function<std::vector<std::uint16_t>(std::uint16_t first, std::size_t count)> read;
  std::function<bool(std::uint16_t first, std::span<const std::uint16_t> values)> write;  // false: an exception
};

// The link of the emulated controller over registers alone, as protocol/MODBUS.md describes them.
class RegisterLink : public world::BoxLink {
 public:
  explicit RegisterLink(Registers registers) : registers_{std::move(registers)} {}

  void postMarker(const Marker& marker) override;
  std::optional<bool> markerAnswer() override { return taken_; }
  void home(const world::Vector3& position_mm) override;
  void askProcedureStatus() override {}
  std::optional<world::Prompt> procedureStatus() override;

  // The value of the entry that begins at this address.
  double value(std::uint16_t address);
  // Writes values of entries that follow each other without a gap. False: an exception.
  bool write(std::uint16_t first, const std::vector<double>& values);

 private:
  world::Vector3 vector(std::uint16_t address);
  ScanPath scan(double reach_mm);

  Registers registers_;
  std::optional<bool> taken_;
  MonoTime posted_{};
  std::uint16_t marker_commit_{};
  std::uint16_t home_commit_{};
  std::array<std::uint16_t, modbus::kRegisterCount> image_{};
};

}  // namespace probebox::scenario
