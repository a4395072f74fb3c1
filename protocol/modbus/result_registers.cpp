#include <deque>
#include <string>

#include "protocol/modbus/map.hpp"
#include "protocol/modbus/result_blocks.hpp"
#include "protocol/modbus/tables.hpp"

namespace probebox::modbus {
namespace {

constexpr std::string_view kSd = "combined standard deviation (k = 1)";
constexpr std::string_view kStateMeans =
    "bit 0 a result is in force, 1 it rests on a retired result, from 4 on one for each value above that it has";
constexpr std::string_view kProposedStateMeans =
    "bit 0 a result is proposed, from 4 on one for each value above that it has";

std::string_view unitOf(ValueUnit unit) {
  switch (unit) {
    case ValueUnit::mm:
      return "mm";
    case ValueUnit::um:
      return "um";
    case ValueUnit::rad:
      return "rad";
    case ValueUnit::number:
      return "";
  }
  return "";
}

std::string_view asFirst(const auto& block) {
  return kept("as " + std::string{block.title} + ", " + std::string{block.values.front().name});
}

void append(std::vector<Register>& all, const ResultBlock& block) {
  const auto at = addressesOf(block);
  const auto title = std::string{block.title};
  const auto register_of = [&](std::uint16_t address, const std::string& name, Kind kind, double scale,
                               std::string_view unit, std::string_view meaning) {
    all.push_back({address, kept(name), kind, scale, unit, Access::read, meaning});
  };
  std::uint16_t address = at.values;
  for (const auto& value : block.values) {
    const bool is_first = &value == block.values.data();
    register_of(address, title + ", " + std::string{value.name}, Kind::f32, 1, unitOf(value.unit),
                is_first ? block.meaning : asFirst(block));
    address = static_cast<std::uint16_t>(address + 2);
  }
  for (const auto& value : block.values) {
    register_of(address, title + ", " + std::string{value.name} + ", sd", Kind::f32, 1, unitOf(value.unit), kSd);
    address = static_cast<std::uint16_t>(address + 2);
  }
  for (const auto& value : block.values) {
    if (!block.in_nm || value.unit != ValueUnit::mm) continue;
    register_of(address, title + ", " + std::string{value.name}, Kind::i32, 1, "nm", "the value in mm above");
    address = static_cast<std::uint16_t>(address + 2);
  }
  register_of(at.result, title + ", result", Kind::u32, 1, "",
              block.is_proposed ? "number of the result, for register 834; 0 when none is newer than the one in force"
                                : "number of the result in force; 0 when there is none");
  register_of(at.tool, title + ", probe tool", Kind::u16, 1, "",
              "number of the tool that carried the probe; 0 without a result");
  register_of(at.state, title + ", state", Kind::u16, 1, "", block.is_proposed ? kProposedStateMeans : kStateMeans);
}

void append(std::vector<Register>& all, const ToolTable& table) {
  const auto at = addressesOf(table);
  const auto title = std::string{table.title} + " N";
  const auto register_of = [&](std::uint16_t address, const std::string& name, Kind kind, double scale,
                               std::string_view unit, std::string_view meaning) {
    all.push_back(
        {address, kept(name), kind, scale, unit, Access::read, meaning, nullptr, kMostToolNumber, kRegistersOfTool});
  };
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const std::string name = title + ", " + std::string{table.values[i].name};
    register_of(static_cast<std::uint16_t>(at.values + 2 * i), name, Kind::f32, 1, "mm",
                i == 0 ? table.meaning : asFirst(table));
  }
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const std::string name = title + ", " + std::string{table.values[i].name};
    register_of(static_cast<std::uint16_t>(at.nm + 2 * i), name, Kind::i32, 1, "nm", "the value in mm above");
  }
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const std::string name = title + ", " + std::string{table.values[i].name} + ", sd";
    register_of(static_cast<std::uint16_t>(at.sd + i), name, Kind::u16, 0.01, "um", kSd);
  }
  register_of(at.state, title + ", state", Kind::u16, 1, "", kStateMeans);
}

}  // namespace

std::string_view kept(std::string text) {
  static std::deque<std::string> texts;
  return texts.emplace_back(std::move(text));
}

std::vector<Register> resultRegisters() {
  std::vector<Register> all;
  for (const auto& block : resultBlocks()) append(all, block);
  for (const auto& table : toolTables()) append(all, table);
  return all;
}

}  // namespace probebox::modbus
