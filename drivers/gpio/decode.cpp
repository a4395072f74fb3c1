#include "drivers/gpio/decode.hpp"

namespace probebox::gpio {

EdgeDecoder::EdgeDecoder(std::vector<WatchedLine> lines) {
  lines_.reserve(lines.size());
  for (const auto& line : lines) lines_.push_back({line, 0, 0});
}

std::optional<Edge> EdgeDecoder::decode(const RawEdge& raw) {
  for (auto& [line, sequence_base, last_sequence] : lines_) {
    if (line.offset != raw.offset) continue;
    const bool active = raw.rising == (line.active == board::ActiveLevel::high);
    last_sequence = sequence_base + raw.line_sequence;
    return Edge{line.role, line.line, active ? Level::active : Level::inactive, last_sequence,
                monoTime(raw.timestamp_ns)};
  }
  ++unknown_edges_;
  return std::nullopt;
}

void EdgeDecoder::restart(std::span<const WatchedLine> lines) {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    lines_[i].line = lines[i];
    lines_[i].sequence_base = lines_[i].last_sequence;
  }
}

}  // namespace probebox::gpio
