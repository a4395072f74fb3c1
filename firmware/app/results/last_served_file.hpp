#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "firmware/corrections/output.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::app {

// What is known at a start of what a CNC has read last.
struct LastServedAtStart {
  std::uint64_t start{};  // number of this start, drawn by chance
  bool is_kept{};         // false: nothing can be written, and what was found stays there
  // What was found, the start by which it was written, and the one whose bounds the disk had then; nothing unless the
  // computer has run without a restart since.
  std::uint64_t found_start{}, found_on_disk{};
  std::uint64_t found_count{};  // see LastRead::count
  std::optional<std::array<double, kLinearAxes>> found_mm{};
};

// What all readers have read last.
struct LastRead {
  std::array<double, kLinearAxes> newest_mm{};
  std::array<double, kLinearAxes> least_mm{}, greatest_mm{};  // of all readers
  std::uint64_t count{};                                      // of records written, over all starts
};

// Remembers what each reader of the correction (a serial line, a computer at a port) has read last: there its axes
// stand. A reader goes on from there at the limit of rate, however far the correction went while it did not read. The
// values are kept in a file that is never synced, so that they survive a killed process in the kernel's page cache. The
// answering thread writes each value before its answer, in microseconds. After a power failure they are lost and the
// bounds of AppliedCorrectionFile apply. Each record has the number of the start that wrote it and its own number, by
// which AppliedCorrectionFile tells one that others have outdated. Any thread.
class LastServedFile {
 public:
  using Correction = std::array<double, kLinearAxes>;
  using Limits = std::array<corrections::OutputLimits, kLinearAxes>;

  // The most time that a reader has in store for motion at the limit of rate: twice the time between its last two
  // reads, and what a core that is behind may publish at once (Output::published). A pause in reading does not fill it
  // further.
  static constexpr Nanoseconds kPublishing = std::chrono::milliseconds{50};
  static constexpr Nanoseconds kLongestStore = std::chrono::seconds{1};
  static constexpr Nanoseconds kUsualInterval = std::chrono::milliseconds{10};  // of one that has not read twice
  // A further reader takes the place of the one that has not read for longest.
  static constexpr std::size_t kReaders = 16;

  // Uses the folder of `path`, or $RUNTIME_DIRECTORY (systemd) if it is set, which is in memory.
  explicit LastServedFile(const std::string& path, const Limits& limits = kNoLimits);

  const LastServedAtStart& before() const { return before_; }

  // Tells what the disk has, before the first note(): the start that wrote it, the number of the last record then, and
  // where the axes stand, if there was an earlier start.
  void setOnDisk(std::uint64_t start, std::uint64_t count = 0, const std::optional<Correction>& applied_mm = {});

  // What was read last, by a reader of this start or of those before it.
  std::optional<LastRead> last();

  // Returns the snapshot as `reader` may see it. Where the correction went on without the reader, it is limited, not
  // settled, and has sequence numbers of its own.
  published::Snapshot shownTo(std::string_view reader, const published::Snapshot& snapshot);

  // Call with what shownTo() returned before `reader` can read its correction, and with no other: axes follow only what
  // is read.
  void note(const published::Snapshot& snapshot, std::string_view reader = {});

 private:
  static constexpr corrections::OutputLimits kNoLimit{std::numeric_limits<double>::infinity(),
                                                      std::numeric_limits<double>::infinity()};
  static constexpr Limits kNoLimits{kNoLimit, kNoLimit, kNoLimit};
  using Nanometres = std::array<std::int32_t, kLinearAxes>;
  struct Reader {
    std::uint32_t key{};
    bool has_read{};  // since the start
    Nanometres value_nm{};
    MonoTime at{};                         // of the snapshot that it read last
    Nanoseconds interval{kUsualInterval};  // between its last two reads
    Nanoseconds stored{};                  // for motion at the limit of rate
    std::uint16_t sequence{};              // of the core in that snapshot
    std::uint16_t ahead{};                 // its own sequence number beyond the core's
    std::uint16_t next_ahead{};
  };

  bool openToWrite();
  void find();
  bool put() const;
  Nanoseconds forMotion(const Reader& reader, MonoTime now) const;
  void spend(Reader& reader, const Nanometres& value_nm, MonoTime now) const;
  Reader* find(std::uint32_t key);
  Reader& entryFor(std::uint32_t key);

  io::Descriptor file_;
  bool writable_{};
  std::string boot_id_;
  std::string place_;
  Limits limits_;
  LastServedAtStart before_;
  std::uint64_t on_disk_{};
  std::mutex mutex_;
  std::vector<Reader> readers_;           // the one that has read last is first
  std::optional<Nanometres> applied_nm_;  // of whom nothing else is known
  std::uint64_t count_{};
  bool is_written_{};  // the file has what readers_ has
  bool failing_{};     // a failure was reported
};

}  // namespace probebox::app
