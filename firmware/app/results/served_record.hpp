#pragma once
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/io/descriptor.hpp"
#include "firmware/published/snapshot.hpp"

namespace probebox::app {

// What is known at a start of what a CNC has read last.
struct ServedBefore {
  std::uint64_t start{};  // number of this start, drawn by chance
  bool is_kept{};         // false: nothing can be written, and what was found stays there
  // What was found, the start by which it was written, and the one whose bounds the disk had then; nothing unless the
  // computer has run without a restart since.
  std::uint64_t found_start{}, found_on_disk{};
  std::optional<std::array<double, kLinearAxes>> found_mm{};
};

// Records the exact correction that a CNC has read last in a file that is never synced, so that it survives a killed
// process in the kernel's page cache. The answering thread writes each value before its answer, in microseconds. After
// a power failure the value is lost and the bounds of StandingKeeper apply. Each record has the number of the start
// that wrote it, by which StandingKeeper tells one that others have outdated. Any thread.
class ServedRecord {
 public:
  // Uses the folder of `path`, or $RUNTIME_DIRECTORY (systemd) if it is set, which is in memory.
  explicit ServedRecord(const std::string& path);

  const ServedBefore& before() const { return before_; }

  // Tells the start whose bounds the disk has, before the first note().
  void setOnDisk(std::uint64_t start) { on_disk_ = start; }

  // The correction noted last, else that of before(), mm.
  std::optional<std::array<double, kLinearAxes>> last();

  // Call with every snapshot before a CNC can read it, and with no other: axes follow only snapshots that a CNC reads.
  void note(const published::Snapshot& snapshot);

 private:
  using Nanometres = std::array<std::int32_t, kLinearAxes>;
  bool openToWrite();
  void find();
  bool put(const Nanometres& value_nm) const;

  io::Descriptor file_;
  bool writable_{};
  std::string boot_id_;
  std::string place_;
  ServedBefore before_;
  std::uint64_t on_disk_{};
  std::mutex mutex_;
  std::optional<Nanometres> last_nm_, written_nm_;  // the same, unless the file takes nothing
  MonoTime noted_at_{};                             // stamp of the last one
  bool failing_{};                                  // a failure was reported
};

}  // namespace probebox::app
