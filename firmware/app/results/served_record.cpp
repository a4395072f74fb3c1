#include "firmware/app/results/served_record.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/magic.h>
#include <span>
#include <sys/vfs.h>
#include <unistd.h>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::app {
namespace {

constexpr std::uint64_t kMark = 0x3164657672657350;  // "Pserved1"
constexpr std::size_t kBootIdBytes = 36;
constexpr std::size_t kRecordBytes = 8 + kBootIdBytes + 3 * 4 + 4;
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

ServedRecord::ServedRecord(const std::string& path)
    : file_{::open(placeOf(path).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)}, boot_id_{bootId()} {
  if (!file_) {
    logWarning(placeOf(path) + " cannot be made (" + std::strerror(errno) +
               "): after a kill the correction sets out from what the disk has");
    return;
  }
  struct statfs about {};
  before_ = found(::fstatfs(file_.get(), &about) == 0 && about.f_type == TMPFS_MAGIC);
}

std::optional<std::array<double, kLinearAxes>> ServedRecord::found(bool in_memory) const {
  Bytes bytes{};
  if (::pread(file_.get(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return std::nullopt;
  frame::ByteReader reader{bytes};
  const auto mark = reader.get<std::uint64_t>();
  const auto id = reader.take(kBootIdBytes);
  const bool same_boot = !boot_id_.empty() && std::memcmp(id.data(), boot_id_.data(), kBootIdBytes) == 0;
  std::array<double, kLinearAxes> served_mm{};
  for (auto& value_mm : served_mm) value_mm = reader.get<std::int32_t>() * 1e-6;
  if (mark != kMark || reader.get<std::uint32_t>() != crcOf(bytes)) return std::nullopt;
  if (!same_boot && !in_memory) return std::nullopt;
  return served_mm;
}

std::optional<std::array<double, kLinearAxes>> ServedRecord::last() {
  const std::lock_guard lock{mutex_};
  if (!last_nm_) return before_;
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
  if (!file_ || written_nm_ == value_nm) return;
  Bytes bytes{};
  frame::ByteWriter writer{bytes};
  writer.put(kMark);
  const auto id = writer.take(kBootIdBytes);
  std::memcpy(id.data(), boot_id_.data(), boot_id_.size());
  for (const auto each_nm : value_nm) writer.put(each_nm);
  writer.put(crcOf(bytes));
  if (::pwrite(file_.get(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    // Said once: the next value is tried again, and what the file holds meanwhile is older than what is served.
    if (!std::exchange(failing_, true))
      logWarning(std::string{"the value that is served cannot be kept ("} + std::strerror(errno) +
                 "): after a kill the correction may set out from an older one; check the disk");
    return;
  }
  failing_ = false;
  written_nm_ = value_nm;
}

}  // namespace probebox::app
