#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/messages/handshake.hpp"

namespace probebox::command {

// Converts counts of a channel to text without rounding noise: counts times 0.001 have exactly three decimals.
class Scale {
 public:
  explicit Scale(double per_count);

  // Decimals that express every multiple of the scale; nothing for a scale such as 1/3.
  const std::optional<int>& decimals() const { return decimals_; }
  // Exact while it has no more than 15 digits; otherwise the shortest digits of the nearest double.
  std::string text(std::int64_t count) const;
  // The double that text() reads as, so that it prints with the same digits.
  double value(std::int64_t count) const;

 private:
  double per_count_;
  std::optional<int> decimals_;
};

// Returns the name of a column with its unit, in which "um/s" becomes um_s.
std::string columnName(const messages::ChannelDescription& channel);

}  // namespace probebox::command
