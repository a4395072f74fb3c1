#include "plc.hpp"

#include <algorithm>
#include <vector>

namespace probebox::scenario {
namespace {

std::size_t wordOfCommit(std::uint16_t commit) {
  for (const auto& area : gcode::loop::areasWritten()) {
    const std::size_t first = area.first;
    if (commit >= first && commit < first + area.count) return area.word + (commit - first);
  }
  return 0;
}

}  // namespace

Plc::Plc(Registers box) : box_{std::move(box)} {
  for (const auto& area : gcode::loop::areasWritten()) sent_[area.commit] = 0;
}

void Plc::cycle() {
  if (!connected_) return;
  const auto& area = gcode::loop::areasRead()[next_++ % gcode::loop::areasRead().size()];
  std::ranges::copy(box_.read(area.first, area.count), words_.begin() + area.word);
  for (const auto& [at, value] : feigned_) words_.at(at) = value;
  for (auto& [commit, sent] : sent_) {
    const auto now = words_.at(wordOfCommit(commit));
    if (now == sent) continue;
    for (const auto& written : gcode::loop::areasWritten()) {
      if (written.commit == commit) send(written);
    }
    sent = now;
  }
}

void Plc::send(const gcode::loop::Area& area) {
  const std::vector<std::uint16_t> values{words_.begin() + area.word, words_.begin() + area.word + area.count};
  if (!box_.write(area.first, values)) ++refused_writes_;
}

std::uint32_t Plc::answer(std::uint32_t asked) {
  if (asked >> 16U == answered_ >> 16U) return answered_;
  const auto at = asked >> 16U & 0x1FFFU;
  const bool writes = (asked >> 29U & 1U) != 0;
  if (writes) words_.at(at) = static_cast<std::uint16_t>(asked);
  answered_ = (asked & 0xFFFF0000U) | (writes ? 0U : words_.at(at));
  return answered_;
}

}  // namespace probebox::scenario
