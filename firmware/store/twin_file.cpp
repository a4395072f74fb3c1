#include "firmware/store/twin_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <optional>
#include <span>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::store {
namespace {

constexpr std::size_t kDiskBlock = 4096;  // no disk has larger ones: a cut write spoils one copy
constexpr std::size_t kCopies = 2;
constexpr std::size_t kHeaderBytes = 24;             // mark, number, length, CRC of all but itself
constexpr std::uint64_t kMark = 0x316e697754786250;  // "PbxTwin1"

struct Copy {
  std::uint64_t number{};
  std::string content;
};

std::uint32_t crcOf(std::span<const std::byte> block) {
  const auto head = frame::crc32c(block.first(20));
  return frame::crc32c(block.subspan(kHeaderBytes), head);
}

// The whole block counts, so that a bit that falls over beyond the text is seen as well.
std::string blockOf(const Copy& copy, std::size_t copy_bytes) {
  std::string block(copy_bytes, '\0');
  const auto bytes = std::as_writable_bytes(std::span{block});
  frame::ByteWriter writer{bytes};
  writer.put(kMark);
  writer.put(copy.number);
  writer.put(static_cast<std::uint32_t>(copy.content.size()));
  std::memcpy(block.data() + kHeaderBytes, copy.content.data(), copy.content.size());
  writer.put(crcOf(bytes));
  return block;
}

std::optional<Copy> copyIn(const std::string& block) {
  if (block.size() < kDiskBlock) return std::nullopt;
  const auto bytes = std::as_bytes(std::span{block});
  frame::ByteReader reader{bytes};
  const auto mark = reader.get<std::uint64_t>();
  const auto number = reader.get<std::uint64_t>();
  const auto size = reader.get<std::uint32_t>();
  const auto crc = reader.get<std::uint32_t>();
  if (mark != kMark || size > block.size() - kHeaderBytes || crc != crcOf(bytes)) return std::nullopt;
  return Copy{number, block.substr(kHeaderBytes, size)};
}

// Empty where the file ends before.
std::string blockAt(int descriptor, std::size_t copy, std::size_t copy_bytes) {
  std::string block(copy_bytes, '\0');
  const auto got = ::pread(descriptor, block.data(), block.size(), static_cast<off_t>(copy * copy_bytes));
  return got == static_cast<ssize_t>(block.size()) ? block : std::string{};
}

std::string reasonNow() {
  return std::strerror(errno);
}

std::string nameOfFresh(const std::string& path) {
  return path + ".new";
}

}  // namespace

TwinFile::TwinFile(std::string path, std::size_t most_bytes)
    : path_{std::move(path)}, copy_bytes_{(most_bytes + kHeaderBytes + kDiskBlock - 1) / kDiskBlock * kDiskBlock} {}

TwinFile::TwinFile(TwinFile&& other) noexcept
    : path_{std::move(other.path_)},
      copy_bytes_{other.copy_bytes_},
      descriptor_{std::exchange(other.descriptor_, -1)},
      number_{other.number_},
      content_{std::move(other.content_)},
      notice_{std::move(other.notice_)},
      why_not_writable_{std::move(other.why_not_writable_)},
      lost_{other.lost_},
      unread_{other.unread_} {}

TwinFile& TwinFile::operator=(TwinFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(copy_bytes_, other.copy_bytes_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(number_, other.number_);
  std::swap(content_, other.content_);
  std::swap(notice_, other.notice_);
  std::swap(why_not_writable_, other.why_not_writable_);
  std::swap(lost_, other.lost_);
  std::swap(unread_, other.unread_);
  return *this;
}

TwinFile::~TwinFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

TwinFile TwinFile::open(const std::string& path, std::size_t most_bytes, std::string_view if_lost, Before before) {
  TwinFile file{path, most_bytes};
  file.descriptor_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file.descriptor_ < 0 && errno != ENOENT) {
    const std::string why = reasonNow();
    file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file.descriptor_ >= 0 || errno != ENOENT) file.why_not_writable_ = path + " cannot be written (" + why + ")";
  }
  if (file.descriptor_ >= 0) {
    file.read(if_lost);
  } else if (errno == ENOENT) {
    if (file.adoptFresh()) return file;
    if (before == Before::had_it) {
      file.lost_ = true;
      file.content_ = if_lost;
      file.notice_ = path + " is gone, and what it had is lost";
    }
    file.make(std::string{file.content_}, {});
  } else {
    // There may be one, and it is not replaced.
    file.lost_ = file.unread_ = true;
    file.content_ = if_lost;
    file.notice_ = path + " cannot be read (" + reasonNow() + ")";
  }
  return file;
}

Outcome<std::string, Failure> TwinFile::peek(const std::string& path, std::size_t most_bytes) {
  TwinFile file{path, most_bytes};
  file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file.descriptor_ < 0 && errno == ENOENT) return std::string{};
  if (file.descriptor_ < 0) return Failure{Reason::unavailable, path + " cannot be read (" + reasonNow() + ")"};
  std::optional<Copy> newest;
  for (std::size_t i = 0; i < kCopies; ++i) {
    auto copy = copyIn(blockAt(file.descriptor_, i, file.copy_bytes_));
    if (copy && (!newest || copy->number > newest->number)) newest = std::move(copy);
  }
  if (!newest) return Failure{Reason::unavailable, path + " is damaged"};
  return std::move(newest->content);
}

// Where the file system has no links a start may end between the two names: the fresh file has what stands for a lost
// text. False when there is none.
bool TwinFile::adoptFresh() {
  const auto left = peek(nameOfFresh(path_), copy_bytes_ - kHeaderBytes);
  if (!left || left->empty()) return false;
  lost_ = true;
  content_ = *left;
  notice_ = path_ + " was damaged, and was moved aside by an earlier start";
  if (std::rename(nameOfFresh(path_).c_str(), path_.c_str()) != 0 || !syncFolderOf(path_)) {
    why_not_writable_ = path_ + " cannot be made (" + reasonNow() + ")";
    return true;
  }
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor_ >= 0) {
    read(*left);
  } else {
    why_not_writable_ = path_ + " cannot be written (" + reasonNow() + ")";
  }
  return true;
}

// The damaged file keeps its place until a whole one takes it, so that the next start finds it lost again.
void TwinFile::replaceLost(std::string_view if_lost) {
  ::close(std::exchange(descriptor_, -1));
  lost_ = true;
  content_ = if_lost;
  notice_ = path_ + " is damaged";
  if (!why_not_writable_.empty()) return;
  const auto aside = asideNameOf(path_, "damaged");
  make(if_lost, aside);
  if (why_not_writable_.empty()) notice_ = path_ + " was damaged, and was moved to " + aside;
}

void TwinFile::read(std::string_view if_lost) {
  std::array<std::optional<Copy>, kCopies> copies;
  const Copy* newest = nullptr;
  for (std::size_t i = 0; i < kCopies; ++i) {
    copies[i] = copyIn(blockAt(descriptor_, i, copy_bytes_));
    if (copies[i] && (newest == nullptr || copies[i]->number > newest->number)) newest = &*copies[i];
  }
  if (newest == nullptr) return replaceLost(if_lost);
  number_ = newest->number;
  content_ = newest->content;
  const bool both_alike = copies[0] && copies[1] && copies[0]->number == copies[1]->number;
  if (both_alike || !why_not_writable_.empty()) return;
  // After a cut in mid-write, or damage: the whole copy is told from now on by both.
  if (!copies[0] || !copies[1]) notice_ = "one of the two copies in " + path_ + " was damaged; the other one is used";
  if (const auto done = writeBoth(std::string{content_}); !done) why_not_writable_ = done.error().what;
}

// Under another name first: the file is whole from the moment that it has its own. aside: where a damaged one goes.
void TwinFile::make(std::string_view text, const std::string& aside) {
  const std::string fresh = nameOfFresh(path_);
  const auto cannot = [&] { return path_ + " cannot be made (" + reasonNow() + ")"; };
  descriptor_ = ::open(fresh.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0) {
    why_not_writable_ = cannot();
    return;
  }
  if (const auto written = writeBoth(text); !written) {
    why_not_writable_ = written.error().what;
  } else if (!aside.empty()) {
    if (const auto placed = putInPlace(fresh, path_, aside); !placed) why_not_writable_ = placed.error().what;
  } else if (std::rename(fresh.c_str(), path_.c_str()) != 0 || !syncFolderOf(path_)) {
    why_not_writable_ = cannot();
  }
  if (why_not_writable_.empty()) return;
  // Where the damaged one is gone the fresh one is all that there is.
  if (aside.empty() || isThere(path_)) ::unlink(fresh.c_str());
  ::close(std::exchange(descriptor_, -1));
}

// A disk that was full or could not be written at the start may have room by now. A file that could not be read is left
// to the next start: nobody knows what it has.
void TwinFile::openAgain() {
  if (unread_) return;
  auto again = open(path_, copy_bytes_ - kHeaderBytes, content_);
  if (!again.why_not_writable_.empty()) {
    why_not_writable_ = again.why_not_writable_;
    return;
  }
  again.content_ = content_;
  again.lost_ = lost_;
  *this = std::move(again);
}

Outcome<void, Failure> TwinFile::write(std::string_view content) {
  if (!why_not_writable_.empty()) openAgain();
  if (!why_not_writable_.empty()) return Failure{Reason::unavailable, why_not_writable_};
  if (isStillAt(path_, descriptor_)) return writeBoth(content);
  ::close(std::exchange(descriptor_, -1));
  const std::string before = content_;
  make(content, isThere(path_) ? asideNameOf(path_, "replaced") : std::string{});
  if (why_not_writable_.empty()) return {};
  content_ = before;
  return Failure{Reason::unavailable, path_ + " was removed: " + why_not_writable_ + "; restore its folder"};
}

Outcome<void, Failure> TwinFile::writeBoth(std::string_view content) {
  const std::size_t room = copy_bytes_ - kHeaderBytes;
  if (content.size() > room)
    return Failure{Reason::bad_argument, path_ + " has room for " + std::to_string(room) + " bytes"};
  const std::string block = nextBlock(content);
  for (std::size_t copy = 0; copy < kCopies; ++copy) {
    if (auto done = writeCopy(copy, block); !done) {
      restore(copy);
      return done;
    }
  }
  content_ = content;
  return {};
}

// One copy may hold the new text by now, and the next start would take it for the last word. The old one in either copy
// has a higher number and overrules it, so each is tried whether or not the other one could be written.
void TwinFile::restore(std::size_t failed) {
  const std::string block = nextBlock(content_);
  for (std::size_t i = 1; i <= kCopies; ++i) (void)writeCopy((failed + i) % kCopies, block);
}

// The number rises after an error too: what one copy may hold by now is never written again under the same number.
std::string TwinFile::nextBlock(std::string_view content) {
  return blockOf({++number_, std::string{content}}, copy_bytes_);
}

Outcome<void, Failure> TwinFile::writeCopy(std::size_t copy, const std::string& block) {
  const auto put = ::pwrite(descriptor_, block.data(), block.size(), static_cast<off_t>(copy * copy_bytes_));
  if (put == static_cast<ssize_t>(block.size()) && ::fdatasync(descriptor_) == 0) return {};
  const std::string why = put >= 0 && put != static_cast<ssize_t>(block.size()) ? "the disk is full" : reasonNow();
  return Failure{Reason::unavailable, path_ + " cannot be written (" + why + "); check the disk"};
}

}  // namespace probebox::store
