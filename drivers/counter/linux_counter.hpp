#pragma once
#include <cstdint>
#include <filesystem>
#include <linux/counter.h>
#include <optional>
#include <string>

#include "board/describe/box.hpp"
#include "drivers/counter/port.hpp"
#include "drivers/io/descriptor.hpp"

namespace probebox::counter {

// Reads one Count of a counter device of the kernel: its value from sysfs, its events from /dev/counterN
// (linux/counter.h).
class LinuxCounter final : public CounterPort {
 public:
  // interval: of polling; not used where the sync line latches the count.
  LinuxCounter(const board::CounterEncoder& described, char axis, Nanoseconds interval);

  Outcome<OpenedCount> open() override;
  void close() override;
  std::optional<std::size_t> readEvents(std::span<CounterEvent> into) override;
  std::optional<PolledCount> poll() override;
  bool isDue(MonoTime now) override;
  int descriptor() const override { return ready_ ? ready_.get() : -1; }

 private:
  bool isLatched() const { return described_.latched_by != board::LatchedBy::polling; }
  Outcome<void> find();
  std::optional<Error> whyNotCounting() const;
  std::string attribute(const std::string& name) const;
  std::optional<std::uint64_t> ceiling() const;
  Outcome<void> openEvents();
  Outcome<void> watch(std::uint8_t event, std::uint8_t channel, bool captured);
  Happened happenedAt(const counter_watch& watch) const;
  Outcome<void> startTimer();

  board::CounterEncoder described_;
  std::string section_;  // "[encoder.X] of box.toml"
  Nanoseconds interval_;
  std::string device_;            // "counter0"
  std::filesystem::path folder_;  // of the count in sysfs
  io::Descriptor value_, events_, timer_, ready_;
};

}  // namespace probebox::counter
