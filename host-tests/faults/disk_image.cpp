#include "host-tests/faults/disk_image.hpp"

#include <algorithm>
#include <fstream>
#include <random>
#include <set>
#include <utility>

#include "host-tests/support/file_content.hpp"

namespace probebox::faults {
namespace {

using support::contentOf;

constexpr std::size_t kDiskBlock = 4096;

bool chance(std::uint64_t& random) {
  random = std::mt19937_64{random}();
  return random % 2 == 0;
}

}  // namespace

DiskImage::DiskImage(std::filesystem::path folder) : folder_{std::move(folder)} {
  for (const auto& entry : std::filesystem::directory_iterator{folder_}) {
    auto content = contentOf(entry.path());
    now_[entry.path().string()] = std::make_shared<File>(File{.now = content, .synced = content, .since = {}});
  }
  synced_ = now_;
}

void DiskImage::land(std::string& content, const Change& change) {
  if (change.truncates) return content.resize(change.offset);
  content.resize(std::max(content.size(), change.offset + change.bytes.size()));
  std::ranges::copy(change.bytes, content.begin() + static_cast<std::ptrdiff_t>(change.offset));
}

void DiskImage::change(File& file, Change change) {
  land(file.now, change);
  file.since.push_back(std::move(change));
}

void DiskImage::note(const Call& call, std::size_t bytes) {
  if (call.kind == Call::Kind::sync && call.path == folder_) {
    synced_ = now_;
    return;
  }
  const auto found = now_.find(call.path);
  if (found == now_.end()) {
    if (call.kind == Call::Kind::open && call.creates) now_[call.path] = std::make_shared<File>();
    return;
  }
  auto& file = *found->second;
  switch (call.kind) {
    case Call::Kind::open:
      if (call.truncates) change(file, {.offset = 0, .bytes = {}, .truncates = true});
      return;
    case Call::Kind::truncate:
      return change(file, {.offset = call.size, .bytes = {}, .truncates = true});
    case Call::Kind::write: {
      const auto count = std::min(bytes, call.bytes.size());
      return change(file, {.offset = call.offset, .bytes = {call.bytes.data(), count}, .truncates = false});
    }
    case Call::Kind::sync:
      file.synced = file.now;
      file.since.clear();
      return;
    case Call::Kind::rename:
      now_[call.to] = found->second;
      now_.erase(call.path);
      return;
    case Call::Kind::link:
      now_[call.to] = found->second;
      return;
    case Call::Kind::remove:
      now_.erase(found);
      return;
    case Call::Kind::read:
    case Call::Kind::make_folder:
      return;
  }
}

// Blocks of what was not synced are on the disk or not, each by itself.
std::string DiskImage::torn(const File& file, std::uint64_t& random) {
  std::string content = file.synced;
  for (const auto& change : file.since) {
    if (change.truncates) {
      if (chance(random)) land(content, change);
      continue;
    }
    for (std::size_t done = 0; done < change.bytes.size();) {
      const std::size_t at = change.offset + done;
      const std::size_t size = std::min(kDiskBlock - at % kDiskBlock, change.bytes.size() - done);
      if (chance(random)) land(content, {.offset = at, .bytes = change.bytes.substr(done, size), .truncates = false});
      done += size;
    }
  }
  return content;
}

void DiskImage::cutPower(Unsynced fate, std::uint64_t seed) const {
  auto random = seed;
  std::set<std::string> names;
  for (const auto& [name, file] : now_) names.insert(name);
  for (const auto& [name, file] : synced_) names.insert(name);
  std::map<const File*, std::string> written;
  std::filesystem::remove_all(folder_);
  std::filesystem::create_directory(folder_);
  for (const auto& name : names) {
    const bool newer = fate == Unsynced::torn && chance(random);
    const auto& entries = newer ? now_ : synced_;
    const auto found = entries.find(name);
    if (found == entries.end()) continue;
    const auto& file = *found->second;
    if (const auto [first, is_new] = written.try_emplace(&file, name); !is_new) {
      std::filesystem::create_hard_link(first->second, name);
      continue;
    }
    std::ofstream{name, std::ios::binary} << (fate == Unsynced::torn ? torn(file, random) : file.synced);
  }
}

std::map<std::string, std::string> DiskImage::present() const {
  std::map<std::string, std::string> all;
  for (const auto& [name, file] : now_) all[name] = file->now;
  return all;
}

}  // namespace probebox::faults
