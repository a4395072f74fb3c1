#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::corrections {

inline constexpr std::size_t kMostTools = 64;
inline constexpr std::size_t kMostMeasuredTools = 99;

struct ToolLength {
  std::uint32_t number{};
  double length_mm{};
  std::uint64_t result_id{};  // assembly result in force that states the length; 0: none does
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
    if (!pose.has_tool) return;
    number_ = pose.tool;
    told_mm_ = pose.tool_length_mm;
    known_ = lengthNow();
  }
  // A measured length replaces the described one, and never one that the controller sends.
  void activate(const ToolLengthActivated& activated) {
    std::size_t place = 0;
    while (place < measured_count_ && measured_[place].number != activated.tool) ++place;
    if (activated.result_id == 0) {
      if (place < measured_count_) measured_[place] = measured_[--measured_count_];
    } else if (place < measured_.size()) {
      measured_count_ = std::max(measured_count_, place + 1);
      measured_[place] = {.number = activated.tool, .length_mm = activated.length_mm, .result_id = activated.result_id};
    }
    known_ = lengthNow();
  }

  std::uint32_t number() const { return number_; }  // 0: no tool
  // nullopt without a tool, or when neither controller, a result in force nor machine.toml gives its length.
  std::optional<double> length_mm() const { return known_ ? std::optional{known_->length_mm} : std::nullopt; }
  void describe(published::SwivelState& state) const {
    state.tool = number_;
    state.has_tool_length = known_.has_value();
    state.tool_length_mm = known_ ? known_->length_mm : 0;
    state.tool_length_from = lengthFrom();
    state.tool_length_result = known_ ? known_->result_id : 0;
  }

 private:
  published::ValueSource lengthFrom() const {
    using enum published::ValueSource;
    if (!known_) return unknown;
    if (known_->result_id != 0) return result;
    return told_mm_ > 0 ? controller : description;
  }
  std::optional<ToolLength> lengthNow() const {
    if (number_ == 0) return std::nullopt;
    if (told_mm_ > 0) return ToolLength{.number = number_, .length_mm = told_mm_};
    using Lengths = std::span<const ToolLength>;
    for (const auto known :
         {Lengths{measured_}.first(measured_count_), Lengths{config_.lengths}.first(config_.count)}) {
      const auto found = std::ranges::find(known, number_, &ToolLength::number);
      if (found != known.end() && found->length_mm > 0) return *found;
    }
    return std::nullopt;
  }

  ToolsConfig config_;
  std::array<ToolLength, kMostMeasuredTools> measured_{};
  std::size_t measured_count_{};
  std::uint32_t number_{};
  double told_mm_{};  // by the controller; 0: it leaves it to the box
  std::optional<ToolLength> known_;
};

}  // namespace probebox::corrections
