#pragma once
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/io/descriptor.hpp"
#include "firmware/published/snapshot.hpp"

namespace probebox::app {

// Records the exact correction that a CNC has read last in a file that is never synced, so that it survives a killed
// process in the kernel's page cache. The answering thread writes each value before its answer, in microseconds. After
// a power failure the value is lost and the bounds of StandingKeeper apply. Any thread.
class ServedRecord {
 public:
  // Uses the folder of `path`, or $RUNTIME_DIRECTORY (systemd) if it is set, which is in memory.
  explicit ServedRecord(const std::string& path);

  // Correction that an earlier process served last, mm; nothing unless the computer has run without a restart since.
  std::optional<std::array<double, kLinearAxes>> before() const { return before_; }

  // The correction noted last, else before(): where the axes stand now.
  std::optional<std::array<double, kLinearAxes>> last();

  // Call with every snapshot before a CNC can read it, and with no other: axes follow only snapshots that a CNC reads.
  void note(const published::Snapshot& snapshot);

 private:
  using Nanometres = std::array<std::int32_t, kLinearAxes>;
  std::optional<std::array<double, kLinearAxes>> found(bool in_memory) const;

  io::Descriptor file_;
  std::string boot_id_;
  std::optional<std::array<double, kLinearAxes>> before_;
  std::mutex mutex_;
  std::optional<Nanometres> last_nm_, written_nm_;  // the same, unless the file takes nothing
  MonoTime noted_at_{};                             // stamp of the last one
  bool failing_{};                                  // a failure was reported
};

}  // namespace probebox::app
