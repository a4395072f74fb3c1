#include "firmware/app/results/last_served_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/magic.h>
#include <random>
#include <ranges>
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

constexpr std::uint64_t kMark = 0x3364657672657350;  // "Pserved3"
constexpr std::size_t kBootIdBytes = 36;
constexpr std::size_t kReaderBytes = 4 + 3 * 4;
constexpr std::size_t kRecordBytes = 8 + kBootIdBytes + 4 * 8 + LastServedFile::kReaders * kReaderBytes + 4;
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

std::int32_t inNanometres(double value_mm) {
  return static_cast<std::int32_t>(std::lround(value_mm * 1e6));
}

std::array<std::int32_t, kLinearAxes> inNanometres(const LastServedFile::Correction& value_mm) {
  return {inNanometres(value_mm[0]), inNanometres(value_mm[1]), inNanometres(value_mm[2])};
}

std::uint32_t keyOf(std::string_view reader) {
  return frame::crc32c(std::as_bytes(std::span{reader}));
}

std::uint32_t crcOf(const Bytes& bytes) {
  return frame::crc32c(std::span{bytes}.first(kRecordBytes - 4));
}

}  // namespace

LastServedFile::LastServedFile(const std::string& path, const Limits& limits)
    : boot_id_{bootId()}, place_{placeOf(path)}, limits_{limits} {
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

bool LastServedFile::openToWrite() {
  file_ = io::Descriptor{::open(place_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
  writable_ = static_cast<bool>(file_);
  return writable_;
}

void LastServedFile::find() {
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
  const auto count = reader.get<std::uint64_t>();
  std::vector<Reader> readers(std::min<std::uint64_t>(reader.get<std::uint64_t>(), kReaders));
  for (auto& each : readers) {
    each.key = reader.get<std::uint32_t>();
    for (auto& value_nm : each.value_nm) value_nm = reader.get<std::int32_t>();
  }
  reader.take((kReaders - readers.size()) * kReaderBytes);
  if (mark != kMark || reader.get<std::uint32_t>() != crcOf(bytes)) return;
  struct statfs about {};
  const bool in_memory = ::fstatfs(file_.get(), &about) == 0 && about.f_type == TMPFS_MAGIC;
  // A file system in memory ends with the computer, unless it is filled again from a disk.
  const bool same_boot = boot_id_.empty() ? in_memory : std::memcmp(id.data(), boot_id_.data(), kBootIdBytes) == 0;
  if (!same_boot || readers.empty()) return;
  before_.found_start = start;
  before_.found_on_disk = on_disk;
  before_.found_count = count_ = count;
  readers_ = std::move(readers);
  before_.found_mm = last()->newest_mm;
}

void LastServedFile::setOnDisk(std::uint64_t start, std::uint64_t count, const std::optional<Correction>& applied_mm) {
  const std::lock_guard lock{mutex_};
  on_disk_ = start;
  count_ = std::max(count_, count);
  if (applied_mm) applied_nm_ = inNanometres(*applied_mm);
}

std::optional<LastRead> LastServedFile::last() {
  const std::lock_guard lock{mutex_};
  if (readers_.empty()) return std::nullopt;
  LastRead all{.count = count_};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto value = [&](const Reader& reader) { return reader.value_nm[axis]; };
    const auto [least, greatest] = std::ranges::minmax(readers_ | std::views::transform(value));
    all.newest_mm[axis] = value(readers_.front()) * 1e-6;
    all.least_mm[axis] = least * 1e-6;
    all.greatest_mm[axis] = greatest * 1e-6;
  }
  return all;
}

LastServedFile::Reader* LastServedFile::find(std::uint32_t key) {
  const auto found = std::ranges::find(readers_, key, &Reader::key);
  return found == readers_.end() ? nullptr : &*found;
}

// The entry of this reader, in the first place.
LastServedFile::Reader& LastServedFile::entryFor(std::uint32_t key) {
  auto found = std::ranges::find(readers_, key, &Reader::key);
  if (found == readers_.end()) {
    if (readers_.size() == kReaders) readers_.pop_back();
    found = readers_.insert(readers_.end(), Reader{.key = key});
  }
  std::rotate(readers_.begin(), found, found + 1);
  return readers_.front();
}

Nanoseconds LastServedFile::forMotion(const Reader& reader, MonoTime now) const {
  const auto most = std::min(2 * reader.interval + kPublishing, kLongestStore);
  if (!reader.has_read) return most;
  return std::min(reader.stored + std::max(now - reader.at, Nanoseconds{0}), most);
}

published::Snapshot LastServedFile::shownTo(std::string_view reader, const published::Snapshot& snapshot) {
  auto shown = snapshot;
  const std::lock_guard lock{mutex_};
  auto* const last = find(keyOf(reader));
  if (last == nullptr && !applied_nm_) return shown;
  const auto& from_nm = last != nullptr ? last->value_nm : *applied_nm_;
  const double for_motion_s =
      std::chrono::duration<double>{last != nullptr ? forMotion(*last, snapshot.at) : 2 * kUsualInterval + kPublishing}
          .count();
  bool has_changed = false;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const double from_mm = from_nm[axis] * 1e-6;
    const double most_mm = limits_[axis].rate_mm_s * for_motion_s;
    const double limited_mm = std::clamp(snapshot.correction_mm[axis], from_mm - most_mm, from_mm + most_mm);
    // In the resolution of the registers, so that a value that is not limited stays as it is.
    if (inNanometres(limited_mm) != inNanometres(snapshot.correction_mm[axis])) {
      shown.correction_mm[axis] = limited_mm;
      shown.settled = false;
    }
    has_changed = has_changed || inNanometres(shown.correction_mm[axis]) != from_nm[axis];
  }
  if (last == nullptr || !last->has_read) return shown;
  // A value that changes while the core's does not has a number of its own.
  last->next_ahead = static_cast<std::uint16_t>(last->ahead + (has_changed && snapshot.sequence == last->sequence));
  shown.sequence = static_cast<std::uint16_t>(shown.sequence + last->next_ahead);
  shown.last_trigger.served.sequence =
      static_cast<std::uint16_t>(shown.last_trigger.served.sequence + last->next_ahead);
  return shown;
}

// Takes the motion to a value out of the store.
void LastServedFile::spend(Reader& reader, const Nanometres& value_nm, MonoTime now) const {
  double longest_s = 0;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const double way_mm = std::abs(value_nm[axis] - reader.value_nm[axis]) * 1e-6;
    if (way_mm > 0) longest_s = std::max(longest_s, way_mm / limits_[axis].rate_mm_s);
  }
  const auto store = forMotion(reader, now);
  const auto spent = std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>{std::min(longest_s, 1.0)});
  reader.stored = std::max(store - spent, Nanoseconds{0});
  if (reader.has_read && now > reader.at) reader.interval = std::min(now - reader.at, kLongestStore);
}

void LastServedFile::note(const published::Snapshot& snapshot, std::string_view reader) {
  // No axis follows a value that is not valid: behind a start in doubt it is only where the box believes them to be.
  if (!snapshot.valid) return;
  const auto value_nm = inNanometres(snapshot.correction_mm);
  const auto key = keyOf(reader);
  const std::lock_guard lock{mutex_};
  if (const auto* const before = find(key); before != nullptr && before->has_read && snapshot.at < before->at) return;
  // Readers at the same value need not be written in the order in which they read.
  const bool is_newest = !readers_.empty() && readers_.front().value_nm == value_nm;
  auto& entry = entryFor(key);
  const bool is_new = !is_newest || !entry.has_read || entry.value_nm != value_nm;
  spend(entry, value_nm, snapshot.at);
  entry.has_read = true;
  entry.value_nm = value_nm;
  entry.at = snapshot.at;
  entry.ahead = entry.next_ahead;
  entry.sequence = static_cast<std::uint16_t>(snapshot.sequence - entry.ahead);
  if (is_written_ && !is_new) return;
  ++count_;
  const bool is_here = writable_ && store::isStillAt(place_, file_.get());
  is_written_ = (is_here || openToWrite()) && put();
  if (is_written_) {
    failing_ = false;
    return;
  }
  const std::string why = std::strerror(errno);
  // An older value must not be taken for this one.
  if (writable_) {
    [[maybe_unused]] const int emptied = ::ftruncate(file_.get(), 0);
  }
  // Said once: the next value is tried again.
  if (!std::exchange(failing_, true))
    logWarning("the value that is served cannot be kept (" + why +
               "): after a kill the correction sets out from what the disk has; check the disk");
}

bool LastServedFile::put() const {
  Bytes bytes{};
  frame::ByteWriter writer{bytes};
  writer.put(kMark);
  const auto id = writer.take(kBootIdBytes);
  std::memcpy(id.data(), boot_id_.data(), boot_id_.size());
  for (const std::uint64_t number : {before_.start, on_disk_, count_, std::uint64_t{readers_.size()}})
    writer.put(number);
  for (const auto& reader : readers_) {
    writer.put(reader.key);
    for (const auto each_nm : reader.value_nm) writer.put(each_nm);
  }
  writer.take((kReaders - readers_.size()) * kReaderBytes);
  writer.put(crcOf(bytes));
  return ::pwrite(file_.get(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
}

}  // namespace probebox::app
