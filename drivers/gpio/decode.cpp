#include "drivers/gpio/decode.hpp"

namespace probebox::gpio {
namespace {

Level levelOf(const WatchedLine& line, bool high) {
  return high == (line.active == board::ActiveLevel::high) ? Level::active : Level::inactive;
}

}  // namespace

EdgeDecoder::EdgeDecoder(std::vector<WatchedLine> lines) {
  lines_.reserve(lines.size());
  for (const auto& line : lines) lines_.push_back({line, 0, 0});
}

std::optional<Edge> EdgeDecoder::decode(const RawEdge& raw) {
  for (auto& [line, sequence_base, last_sequence] : lines_) {
    if (line.offset != raw.offset) continue;
    last_sequence = sequence_base + raw.line_sequence;
    return Edge{line.role, line.line, levelOf(line, raw.rising), last_sequence, monoTime(raw.timestamp_ns)};
  }
  ++unknown_edges_;
  return std::nullopt;
}

std::optional<Edge> EdgeDecoder::found(unsigned offset, bool high) const {
  for (const auto& [line, sequence_base, last_sequence] : lines_) {
    if (line.offset == offset) return Edge{line.role, line.line, levelOf(line, high), last_sequence, MonoTime{}};
  }
  return std::nullopt;
}

void EdgeDecoder::restart(std::span<const WatchedLine> lines) {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    lines_[i].line = lines[i];
    lines_[i].sequence_base = lines_[i].last_sequence;
  }
}

}  // namespace probebox::gpio
