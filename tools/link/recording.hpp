#pragma once
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame/frame.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/stream_reader.hpp"

// A recording (.pbx) is the box's frames as they came, delimited: the same bytes as on a serial line. It may be cut at
// any byte and still be read up to there.
namespace probebox::link {

class RecordingWriter {
 public:
  // `out` is opened in binary mode and outlives the writer.
  explicit RecordingWriter(std::ostream& out);

  // False when the stream does not take it: the disk is full.
  bool write(const frame::Frame& frame);
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::ostream& out_;
  std::vector<std::byte> scratch_;
  std::vector<std::byte> coded_;
  std::uint64_t bytes_{};
};

// How a recording ended.
struct RecordingEnd {
  frame::ReaderCounters frames{};
  ReaderFaults faults{};
  std::size_t cut_bytes{};  // of a last frame that does not end
  bool closed{};            // by the ledger of a STOP; otherwise what came after `next` is unknown
  SampleIndex next{};
  std::optional<Balance> balance{};  // as of the last heartbeat
};

// Fails when the file cannot be read or holds no frame. "-" is the standard input.
Outcome<RecordingEnd> readRecording(const std::string& path, StreamListener& listener);
Outcome<RecordingEnd> readRecording(std::istream& in, StreamListener& listener);

}  // namespace probebox::link
