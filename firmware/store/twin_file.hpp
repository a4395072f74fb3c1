#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/store/failure.hpp"
#include "firmware/store/set_aside.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// Stores one small text so that it survives any interruption. The file has its full size from the beginning and holds
// two copies, each with an increasing number and a CRC-32C. An interrupted write or a damaged disk block spoils only
// one copy; a full disk spoils none, because the file does not grow. One thread.
class TwinFile {
 public:
  // Reads the last text, or makes the file with room for `most_bytes`. A file without an intact copy is moved aside,
  // never deleted, and a whole one with the text `if_lost` takes its place: what is safe for the owner to believe while
  // nobody knows the lost text. However the call ends, the next one finds the damaged file or that text. Never fails:
  // whyNotWritable() reports problems of the disk.
  static TwinFile open(const std::string& path, std::size_t most_bytes, std::string_view if_lost,
                       Before before = Before::perhaps);

  // Reads the newest intact text and changes nothing, beside another process that may write: for who only looks. Empty
  // where there is no file.
  static Outcome<std::string, Failure> peek(const std::string& path, std::size_t most_bytes);

  TwinFile(TwinFile&& other) noexcept;
  TwinFile& operator=(TwinFile&& other) noexcept;
  ~TwinFile();

  // Empty when nothing was ever written.
  const std::string& content() const { return content_; }
  // Notice about the opening, for a person; empty without one.
  const std::string& notice() const { return notice_; }
  // True if an earlier text could not be read: content() is the text `if_lost`. The next start finds that text as any
  // other one.
  bool lost() const { return lost_; }
  // Why the file cannot be written, as far as it was tried; empty when it can.
  const std::string& whyNotWritable() const { return why_not_writable_; }

  // A file that could not be read is replaced by the next write, too: what it has is not to be believed any more.
  void replaceUnread() { unread_ = false; }

  // Both copies are on disk when this returns. On an error content() stays unchanged and is written again, so that the
  // next start finds it, too. A file that was removed meanwhile is made anew. A file that could not be written is
  // opened again first; one that could not be read is left to the next start, unless replaceUnread() was called.
  Outcome<void, Failure> write(std::string_view content);

 private:
  TwinFile(std::string path, std::size_t most_bytes);
  void make(std::string_view text, const std::string& aside);
  bool adoptFresh();
  void replaceLost(std::string_view if_lost);
  void read(std::string_view if_lost);
  void openAgain();
  Outcome<void, Failure> writeBoth(std::string_view content);
  void restore(std::size_t failed);
  std::string nextBlock(std::string_view content);
  Outcome<void, Failure> writeCopy(std::size_t copy, const std::string& block);

  std::string path_;
  std::size_t copy_bytes_;
  int descriptor_{-1};
  std::uint64_t number_{};
  std::string content_;
  std::string notice_;
  std::string why_not_writable_;
  bool lost_{};
  bool unread_{};
};

}  // namespace probebox::store
