#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/events/event.hpp"

namespace probebox::corrections {

inline constexpr std::size_t kMostTools = 64;

struct ToolLength {
  std::uint32_t number{};
  double length_mm{};
};

// The tools described in machine.toml.
struct ToolsConfig {
  std::size_t count{};
  std::array<ToolLength, kMostTools> lengths{};
};

// Holds the tool in the spindle. Only the controller reports it, so there is none after a start.
class ToolInSpindle {
 public:
  explicit ToolInSpindle(const ToolsConfig& config) : config_{config} {}

  void told(const PoseTold& pose) {
    if (pose.has_tool) number_ = pose.tool, length_mm_ = lengthOf(pose);
  }

  std::uint32_t number() const { return number_; }  // 0: no tool
  // nullopt without a tool, or when neither controller nor machine.toml gives its length.
  std::optional<double> length_mm() const { return length_mm_; }

 private:
  std::optional<double> lengthOf(const PoseTold& pose) const {
    if (pose.tool == 0) return std::nullopt;
    if (pose.tool_length_mm > 0) return pose.tool_length_mm;
    const std::span known{config_.lengths.data(), config_.count};
    const auto found = std::ranges::find(known, pose.tool, &ToolLength::number);
    return found == known.end() ? std::nullopt : std::optional{found->length_mm};
  }

  ToolsConfig config_;
  std::uint32_t number_{};
  std::optional<double> length_mm_;
};

}  // namespace probebox::corrections
