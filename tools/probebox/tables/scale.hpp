#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/messages/handshake.hpp"

namespace probebox::command {

// What one count of a channel means, as it is printed: whole counts times 0.001 have three decimals and no noise.
class Scale {
 public:
  explicit Scale(double per_count);

  // Decimals that every multiple of the scale fits in; nothing for a scale such as 1/3, which no decimals express.
  const std::optional<int>& decimals() const { return decimals_; }
  // Exact while it has no more than 15 digits; otherwise the shortest digits of the nearest double.
  std::string text(std::int64_t count) const;
  // The double that text() reads as, so that it prints with the same digits.
  double value(std::int64_t count) const;

 private:
  double per_count_;
  std::optional<int> decimals_;
};

// The column's name with its unit. "um/s" cannot stand in it and becomes um_s.
std::string columnName(const messages::ChannelDescription& channel);

}  // namespace probebox::command
