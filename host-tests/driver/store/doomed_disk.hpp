#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <sqlite3.h>
#include <string>
#include <vector>

namespace probebox::store {

// A disk in memory under the real SQLite, as its default VFS (one object at a time, one thread). Keeps for every file
// its synced content and the list of writes since the last sync, and fails on command.
class DoomedDisk {
 public:
  // What the disk promises; a real one under Linux is the first.
  struct Promises {
    int sector_bytes{4096};
    bool keeps_neighbours{true};  // a torn write damages no byte beside it
  };
  DoomedDisk() : DoomedDisk(Promises{}) {}
  explicit DoomedDisk(Promises promises);
  ~DoomedDisk();
  DoomedDisk(const DoomedDisk&) = delete;
  DoomedDisk& operator=(const DoomedDisk&) = delete;

  // Calls counted from now on: those that change the disk, and all.
  std::size_t changes() const { return changes_; }
  std::size_t calls() const { return calls_; }

  // From the n-th change on nothing reaches the disk any more, and every call fails: the power is off.
  void cutPowerAt(std::size_t change) { power_off_at_ = change; }
  // Every write from the n-th change on finds the disk full.
  void fillUpAt(std::size_t change) { full_at_ = change; }
  // The n-th call fails; with `for_good` all later ones too.
  void failAt(std::size_t call, bool for_good);
  // Space, power and health are back; the counters begin anew.
  void repair();

  // Leaves after a power cut the synced part, and of the rest nothing, everything in order, or random pieces of sector
  // size. No file may be open.
  enum class Unsynced { lost, written, torn };
  void powerOn(Unsynced fate, std::uint64_t seed = 0);

  // All that the disk holds and has not synced yet, to go back to.
  struct Bytes {
    std::vector<char> content;
    bool exists{};
    friend bool operator==(const Bytes&, const Bytes&) = default;
  };
  struct Change {
    enum class Kind { write, truncate } kind{};
    std::size_t offset{};  // of a truncation: the new size
    std::vector<char> bytes;
  };
  struct File {
    Bytes now;                  // as a running program sees it
    Bytes synced;               // what a cut leaves for certain; exists: its directory entry is on the disk
    std::vector<Change> since;  // after the last sync
  };
  using Image = std::map<std::string, File>;
  const Image& image() const { return files_; }
  void setImage(Image image) { files_ = std::move(image); }

 private:
  friend struct DoomedCalls;
  int changing(bool grows);
  int calling(int error);

  sqlite3_vfs vfs_{};
  sqlite3_vfs* before_{};
  Promises promises_;
  Image files_;
  std::size_t changes_{}, calls_{};
  std::optional<std::size_t> power_off_at_, full_at_, fail_at_;
  bool fails_for_good_{};
};

}  // namespace probebox::store
