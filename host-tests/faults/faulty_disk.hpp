#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "host-tests/faults/disk_image.hpp"
#include "host-tests/faults/supervised.hpp"

namespace probebox::faults {

enum class Fault : std::uint8_t {
  kill,           // the process dies before the call
  cut_lost,       // the power fails; nothing that was not synced is on the disk
  cut_torn,       // the power fails; blocks that were not synced are on the disk or not, by chance
  fail_once,      // the call fails (EIO)
  fail_for_good,  // it and all later ones fail
  full,           // from it on the disk is full: files neither grow nor are made
  shorten,        // half of the bytes are written
};
inline constexpr std::size_t kFaults = 7;
std::string_view name(Fault fault);
bool cutsPower(Fault fault);

// A file of a box that lies in memory: no fault of the disk reaches it.
inline constexpr std::string_view kInMemory = "served-last";

// The disk under a supervised process, with one fault at the n-th call (from 1) on the files of the folder.
class FaultyDisk {
 public:
  FaultyDisk(Fault fault, std::size_t call, const std::filesystem::path& folder)
      : fault_{fault}, call_{call}, folder_{folder}, image_{folder} {}

  Decision decide(const Call& call);

  // Makes the folder what a cut of the power leaves now.
  void cutPower() const;

  bool reached() const { return reached_; }  // the process made so many calls
  bool applies() const { return applies_; }  // a fault of this kind can be put on the call
  const std::string& at() const { return at_; }
  bool folderFailed() const { return folder_failed_; }  // it could not be opened

 private:
  Decision decisionAbout(const Call& call);

  Fault fault_;
  std::size_t call_;
  std::filesystem::path folder_;
  DiskImage image_;
  std::size_t calls_{};
  bool reached_{};
  bool applies_{};
  bool folder_failed_{};
  std::string at_;
};

}  // namespace probebox::faults
