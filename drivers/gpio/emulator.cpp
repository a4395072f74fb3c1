#include "drivers/gpio/emulator.hpp"

namespace probebox::gpio {
namespace {

std::vector<WatchedLine> watchedLines(const ChipLines& chip) {
  std::vector<WatchedLine> lines;
  for (const auto& line : chip.lines) {
    lines.push_back(line.watched);
    if (const auto* const offset = std::get_if<unsigned>(&line.address)) lines.back().offset = *offset;
  }
  return lines;
}

bool asked(const WatchedLine& line, bool high) {
  return line.edges == Edges::both || high == (line.active == board::ActiveLevel::high);
}

}  // namespace

EmulatedGpio::EmulatedGpio(const ChipLines& chip, std::size_t queue_edges)
    : name_{"emulated " + chip.chip}, decoder_{watchedLines(chip)}, queue_(queue_edges) {
  for (const auto& line : watchedLines(chip)) {
    wires_.push_back({line, line.active == board::ActiveLevel::low, 0});
    loss_.add(sourceOf(line.role));
  }
  loss_.settle();
}

void EmulatedGpio::drive(unsigned offset, bool high, MonoTime at) {
  for (auto& wire : wires_) {
    if (wire.line.offset != offset || wire.high == high) continue;
    wire.high = high;
    if (connected_ && asked(wire.line, high)) push({offset, high, toNs(at), ++wire.sequence});
  }
}

void EmulatedGpio::push(const RawEdge& edge) {
  if (size_ == queue_.size()) {
    first_ = (first_ + 1) % queue_.size();
    --size_;
    ++lost_edges_;
  }
  queue_[(first_ + size_) % queue_.size()] = edge;
  ++size_;
}

void EmulatedGpio::disconnect() {
  connected_ = false;
  size_ = 0;
  loss_.raise();
}

void EmulatedGpio::reconnect() {
  std::vector<WatchedLine> lines;
  for (auto& wire : wires_) {
    wire.sequence = 0;
    lines.push_back(wire.line);
  }
  decoder_.restart(lines);
  connected_ = true;
}

std::size_t EmulatedGpio::read(std::span<Event> into, MonoTime now) {
  std::size_t count = loss_.read(into, now);
  while (count < into.size() && size_ > 0 && queue_[first_].timestamp_ns <= toNs(now)) {
    if (const auto edge = decoder_.decode(queue_[first_])) into[count++] = *edge;
    first_ = (first_ + 1) % queue_.size();
    --size_;
  }
  return count;
}

}  // namespace probebox::gpio
