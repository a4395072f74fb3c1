#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "host-tests/faults/call.hpp"

namespace probebox::faults {

// What a disk holds for certain of the files of one folder, and what is on its way to it: contents since the last sync
// of the file, names since the last sync of the folder.
class DiskImage {
 public:
  // All that is in the folder is on the disk.
  explicit DiskImage(std::filesystem::path folder);

  // The process makes this call now. bytes: how many of a write.
  void note(const Call& call, std::size_t bytes = ~std::size_t{0});

  // Makes the folder what a cut of the power leaves. lost: nothing that was not synced; torn: blocks and names by
  // chance, the old or the new.
  enum class Unsynced : std::uint8_t { lost, torn };
  void cutPower(Unsynced fate, std::uint64_t seed) const;

  // As a process sees it. A test compares it with the folder.
  std::map<std::string, std::string> present() const;

 private:
  struct Change {
    std::size_t offset{};
    std::string bytes;
    bool truncates{};  // to `offset`
  };
  struct File {
    std::string now;
    std::string synced;
    std::vector<Change> since;
  };
  using Names = std::map<std::string, std::shared_ptr<File>>;

  static void land(std::string& content, const Change& change);
  void change(File& file, Change change);
  static std::string torn(const File& file, std::uint64_t& random);

  std::filesystem::path folder_;
  Names now_;
  Names synced_;
};

}  // namespace probebox::faults
