// The part of the image that is not of one tick: results in force.
#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "firmware/modbus/register_image.hpp"
#include "protocol/modbus/result_blocks.hpp"

namespace probebox::modbus {
namespace {

using published::ServedResult;
using published::ServedValue;

constexpr std::size_t kMostBlockValues = 8;

// A value of a block, with its sd; nothing where the result does not have it.
struct Shown {
  double value{}, sd{};
};
std::optional<Shown> shownOf(const ServedResult& result, const BlockValue& wanted) {
  for (const auto& [key, index] : wanted.keys) {
    if (key.empty()) continue;
    const auto found = std::ranges::find(result.values, key, &ServedValue::key);
    if (found == result.values.end() || index >= found->values.size()) continue;
    return Shown{found->values[index], index < found->sd.size() ? found->sd[index] : 0};
  }
  return std::nullopt;
}

double stateOf(const ServedResult& result, std::span<const std::optional<Shown>> shown) {
  unsigned state = kInForce;
  if (result.rests_on_retired) state |= kRestsOnRetired;
  for (std::size_t i = 0; i < shown.size(); ++i) state |= shown[i] ? 1U << (kFirstKnownBit + i) : 0U;
  return state;
}

std::optional<std::uint16_t> toolOf(std::string_view subject, std::string_view prefix) {
  if (!subject.starts_with(prefix)) return std::nullopt;
  const auto digits = subject.substr(prefix.size());
  std::uint16_t tool = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), tool);
  const bool is_row =
      error == std::errc{} && end == digits.data() + digits.size() && tool >= 1 && tool <= kMostToolNumber;
  return is_row ? std::optional{tool} : std::nullopt;
}

}  // namespace

void RegisterImage::putResults(const published::ServedResults& results) {
  constexpr std::size_t kFirstTable = 1000;
  std::fill(image_.begin() + kFirstTable, image_.end(), std::uint16_t{0});
  static const ServedResult kNone{};
  for (const auto& block : resultBlocks()) {
    const auto& among = block.is_proposed ? results.proposed : results.in_force;
    const auto found = std::ranges::find(among, block.subject, &ServedResult::subject);
    const bool exists = found != among.end();
    const auto& result = exists ? *found : kNone;
    const auto at = addressesOf(block);
    std::array<std::optional<Shown>, kMostBlockValues> shown{};
    std::size_t nm = at.nm;
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      shown[i] = shownOf(result, block.values[i]);
      const Shown value = shown[i].value_or(Shown{});
      put(at.values + 2 * i, value.value);
      put(at.sd + 2 * i, value.sd);
      if (!block.in_nm || block.values[i].unit != ValueUnit::mm) continue;
      put(nm, value.value * 1e6);
      nm += 2;
    }
    put(at.result, static_cast<double>(result.result_id & 0xFFFFFFFFU));
    put(at.tool, result.probe_tool);
    put(at.state, exists ? stateOf(result, std::span{shown}.first(block.values.size())) : 0);
  }
  for (const auto& table : toolTables()) {
    for (const auto& result : results.in_force) {
      const auto tool = toolOf(result.subject, table.prefix);
      if (!tool) continue;
      const auto at = addressesOf(table);
      const std::size_t row = std::size_t{kRegistersOfTool} * (*tool - 1U);
      std::array<std::optional<Shown>, kMostBlockValues> shown{};
      for (std::size_t i = 0; i < table.values.size(); ++i) {
        shown[i] = shownOf(result, table.values[i]);
        const Shown value = shown[i].value_or(Shown{});
        put(row + at.values + 2 * i, value.value);
        put(row + at.nm + 2 * i, value.value * 1e6);
        put(row + at.sd + i, value.sd * 1e3);
      }
      put(row + at.state, stateOf(result, std::span{shown}.first(table.values.size())));
    }
  }
}

}  // namespace probebox::modbus
