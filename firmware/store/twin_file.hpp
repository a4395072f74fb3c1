#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::store {

// One small text that survives every end. The file has its full size from the beginning and holds the text twice, each
// copy with a number that rises and a CRC-32C: a cut write spoils one copy, a damaged disk block too, and a full disk
// none, because nothing grows. One thread.
class TwinFile {
 public:
  // Reads what was written last, or makes the file, with room for `most_bytes`. One without a whole copy is moved
  // aside, never deleted. Never fails: where the disk gives or takes nothing, whyNotWritable() says so.
  static TwinFile open(const std::string& path, std::size_t most_bytes);

  TwinFile(TwinFile&& other) noexcept;
  TwinFile& operator=(TwinFile&& other) noexcept;
  ~TwinFile();

  // Empty when nothing was ever written.
  const std::string& content() const { return content_; }
  // What a person must know about the opening; empty when all was well.
  const std::string& notice() const { return notice_; }
  // Something was written once, and cannot be read any more: content() is empty for that reason.
  bool lost() const { return lost_; }
  // Why write() cannot succeed; empty when it can.
  const std::string& whyNotWritable() const { return why_not_writable_; }

  // Both copies are on the disk when this returns; on an error content() stays what it was, and the disk is given it
  // again, so that the next start finds it too.
  Outcome<void, Failure> write(std::string_view content);

 private:
  TwinFile(std::string path, std::size_t most_bytes);
  void make();
  void read();
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
};

}  // namespace probebox::store
