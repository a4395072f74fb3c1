#include "firmware/app/results/served_record.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/magic.h>
#include <random>
#include <span>
#include <sys/vfs.h>
#include <unistd.h>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/store/set_aside.hpp"
#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::app {
namespace {

constexpr std::uint64_t kMark = 0x3264657672657350;  // "Pserved2"
constexpr std::size_t kBootIdBytes = 36;
constexpr std::size_t kRecordBytes = 8 + kBootIdBytes + 2 * 8 + 3 * 4 + 4;
using Bytes = std::array<std::byte, kRecordBytes>;

// Boot id of the running kernel; empty if a sandbox hides it.
std::string bootId() {
  std::ifstream file{"/proc/sys/kernel/random/boot_id"};
  std::string id;
  file >> id;
  return id.size() == kBootIdBytes ? id : std::string{};
}

std::string placeOf(const std::string& path) {
  const char* runtime = std::getenv("RUNTIME_DIRECTORY");
  if (runtime == nullptr || *runtime == '\0') return path;
  return (std::filesystem::path{runtime} / std::filesystem::path{path}.filename()).string();
}

std::uint32_t crcOf(const Bytes& bytes) {
  return frame::crc32c(std::span{bytes}.first(kRecordBytes - 4));
}

}  // namespace

ServedRecord::ServedRecord(const std::string& path) : boot_id_{bootId()}, place_{placeOf(path)} {
  std::random_device chance;
  before_.start = std::uint64_t{chance()} << 32 | chance();
  if (!openToWrite()) {
    failing_ = true;
    logWarning(place_ + " cannot be written (" + std::strerror(errno) +
               "): after a kill the correction sets out from what the disk has");
    file_ = io::Descriptor{::open(place_.c_str(), O_RDONLY | O_CLOEXEC)};
  }
  if (file_) find();
}

bool ServedRecord::openToWrite() {
  file_ = io::Descriptor{::open(place_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
  writable_ = static_cast<bool>(file_);
  return writable_;
}

void ServedRecord::find() {
  Bytes bytes{};
  const auto size = ::pread(file_.get(), bytes.data(), bytes.size(), 0);
  // Tried with what it has already.
  before_.is_kept =
      writable_ && size >= 0 && ::pwrite(file_.get(), bytes.data(), static_cast<std::size_t>(size), 0) == size;
  if (size != static_cast<ssize_t>(bytes.size())) return;
  frame::ByteReader reader{bytes};
  const auto mark = reader.get<std::uint64_t>();
  const auto id = reader.take(kBootIdBytes);
  const auto start = reader.get<std::uint64_t>();
  const auto on_disk = reader.get<std::uint64_t>();
  std::array<double, kLinearAxes> served_mm{};
  for (auto& value_mm : served_mm) value_mm = reader.get<std::int32_t>() * 1e-6;
  if (mark != kMark || reader.get<std::uint32_t>() != crcOf(bytes)) return;
  struct statfs about {};
  const bool in_memory = ::fstatfs(file_.get(), &about) == 0 && about.f_type == TMPFS_MAGIC;
  // A file system in memory ends with the computer, unless it is filled again from a disk.
  const bool same_boot = boot_id_.empty() ? in_memory : std::memcmp(id.data(), boot_id_.data(), kBootIdBytes) == 0;
  if (!same_boot) return;
  before_.found_start = start;
  before_.found_on_disk = on_disk;
  before_.found_mm = served_mm;
}

std::optional<std::array<double, kLinearAxes>> ServedRecord::last() {
  const std::lock_guard lock{mutex_};
  if (!last_nm_) return before_.found_mm;
  std::array<double, kLinearAxes> last_mm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) last_mm[axis] = (*last_nm_)[axis] * 1e-6;
  return last_mm;
}

void ServedRecord::note(const published::Snapshot& snapshot) {
  // No axis follows a value that is not valid: behind a start in doubt it is only where the box believes them to be.
  if (!snapshot.valid) return;
  Nanometres value_nm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    value_nm[axis] = static_cast<std::int32_t>(std::lround(snapshot.correction_mm[axis] * 1e6));
  const std::lock_guard lock{mutex_};
  if (snapshot.at < noted_at_) return;
  noted_at_ = snapshot.at;
  last_nm_ = value_nm;
  if (written_nm_ == value_nm) return;
  const bool is_here = writable_ && store::isStillAt(place_, file_.get());
  if (!(is_here || openToWrite()) || !put(value_nm)) {
    const std::string why = std::strerror(errno);
    // An older value must not be taken for this one.
    if (writable_) {
      [[maybe_unused]] const int emptied = ::ftruncate(file_.get(), 0);
    }
    written_nm_.reset();
    // Said once: the next value is tried again.
    if (!std::exchange(failing_, true))
      logWarning("the value that is served cannot be kept (" + why +
                 "): after a kill the correction sets out from what the disk has; check the disk");
    return;
  }
  failing_ = false;
  written_nm_ = value_nm;
}

bool ServedRecord::put(const Nanometres& value_nm) const {
  Bytes bytes{};
  frame::ByteWriter writer{bytes};
  writer.put(kMark);
  const auto id = writer.take(kBootIdBytes);
  std::memcpy(id.data(), boot_id_.data(), boot_id_.size());
  writer.put(before_.start);
  writer.put(on_disk_);
  for (const auto each_nm : value_nm) writer.put(each_nm);
  writer.put(crcOf(bytes));
  return ::pwrite(file_.get(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
}

}  // namespace probebox::app
