#pragma once
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/io/descriptor.hpp"
#include "firmware/published/snapshot.hpp"

namespace probebox::app {

// The correction that a CNC has read last, exactly, where a killed process leaves it: in the kernel's memory of a file
// that is never synced. Each value is written before the answer that has it, by the thread that answers, in
// microseconds. A power cut takes it; what is certain then is StandingKeeper's. Any thread.
class ServedRecord {
 public:
  // In the folder of `path`, or in $RUNTIME_DIRECTORY (systemd) where that is given: it is memory.
  explicit ServedRecord(const std::string& path);

  // What was served last by a process before this one, mm; nothing unless this is certain: the computer has run since.
  std::optional<std::array<double, kLinearAxes>> before() const { return before_; }

  // To be called with everything that a CNC gets to read, before it does.
  void note(const published::Snapshot& snapshot);

 private:
  using Nanometres = std::array<std::int32_t, kLinearAxes>;
  std::optional<std::array<double, kLinearAxes>> found(bool in_memory) const;

  io::Descriptor file_;
  std::string boot_id_;
  std::optional<std::array<double, kLinearAxes>> before_;
  std::mutex mutex_;
  std::optional<Nanometres> noted_nm_;
  MonoTime noted_at_{};
  bool failing_{};  // and said so
};

}  // namespace probebox::app
