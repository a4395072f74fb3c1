#include "tools/probebox/tables/trigger_table.hpp"

#include <array>
#include <iostream>
#include <limits>
#include <string_view>
#include <vector>

#include "protocol/frame/bytes.hpp"
#include "protocol/units/angle.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/tables/csv_rows.hpp"
#include "tools/probebox/tables/npy_rows.hpp"

namespace probebox::command {
namespace {

// The columns, once for both formats. column(name, NumPy's type, value).
void columns(const messages::Trigger& t, auto&& column) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const auto position = [&](std::size_t axis) {
    return (unsigned{t.has_position} >> axis & 1U) != 0 ? t.position_mm[axis] : kUnknown;
  };
  const auto angle = [&](std::size_t axis) {
    return (unsigned{t.has_angle} >> axis & 1U) != 0 ? degrees(t.angle_rad[axis]) : kUnknown;
  };
  column("number", "<u4", t.number);
  column("line", "|u1", t.line);
  column("line_sequence", "<u4", t.line_sequence);
  column("at_ns", "<i8", toNs(t.at));
  column("tick", "<i8", t.tick.index);
  column("phase_q32", "<u4", t.phase_q32);
  column("sigma_ns", "<u4", t.sigma_ns);
  column("clock_state", "|u1", static_cast<std::uint8_t>(t.clock_state));
  column("x_mm", "<f8", position(0));
  column("y_mm", "<f8", position(1));
  column("z_mm", "<f8", position(2));
  column("correction_x_mm", "<f8", t.correction_mm[0]);
  column("correction_y_mm", "<f8", t.correction_mm[1]);
  column("correction_z_mm", "<f8", t.correction_mm[2]);
  column("correction_valid", "|u1", std::uint8_t{t.correction_valid});
  column("correction_degraded", "|u1", std::uint8_t{t.correction_degraded});
  column("correction_sequence", "<u2", t.sequence);
  column("a_deg", "<f8", angle(0));
  column("b_deg", "<f8", angle(1));
  column("c_deg", "<f8", angle(2));
}

template <class T>
constexpr bool kIsFloat = std::same_as<T, double>;

std::string csv(std::span<const messages::Trigger> triggers) {
  std::string text;
  columns({}, [&](std::string_view name, auto, auto) { text += (text.empty() ? "" : ",") + std::string{name}; });
  text += '\n';
  for (const auto& trigger : triggers) {
    bool first = true;
    columns(trigger, [&](auto, auto, auto value) {
      if (!std::exchange(first, false)) text += ',';
      if constexpr (kIsFloat<decltype(value)>) {
        if (value == value) append(text, value);
      } else {
        append(text, +value);
      }
    });
    text += '\n';
  }
  return text;
}

std::string npy(std::span<const messages::Trigger> triggers) {
  std::string types;
  columns({}, [&](std::string_view name, std::string_view type, auto) {
    types += "('" + std::string{name} + "', '" + std::string{type} + "'), ";
  });
  std::string bytes = npyHeader(types, triggers.size());
  for (const auto& trigger : triggers) {
    columns(trigger, [&](auto, auto, auto value) {
      std::array<std::byte, sizeof value> field{};
      frame::ByteWriter{field}.put(value);
      bytes.append(reinterpret_cast<const char*>(field.data()), field.size());
    });
  }
  return bytes;
}

}  // namespace

std::optional<std::string> writeTriggers(const std::string& path, bool force,
                                         std::span<const messages::Trigger> triggers) {
  auto output = Output::open(path, force, std::cout);
  if (!output) return output.error().what;
  const bool written = output->write(path.ends_with(".npy") ? npy(triggers) : csv(triggers)) && output->finish();
  if (!written) return output->failure();
  return std::nullopt;
}

}  // namespace probebox::command
