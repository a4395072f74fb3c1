#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame/frame.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/stream_reader.hpp"

// Writes and reads recordings (.pbx): the delimited frames of the box, the same bytes as on a serial line. A recording
// that is cut at any byte can be read up to there.
namespace probebox::link {

class RecordingWriter {
 public:
  // `out` is opened in binary mode and outlives the writer.
  explicit RecordingWriter(std::ostream& out);

  // Returns false when the stream fails, such as on a full disk.
  bool write(const frame::Frame& frame);
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::ostream& out_;
  std::vector<std::byte> scratch_;
  std::vector<std::byte> coded_;
  std::uint64_t bytes_{};
};

// State of a recording at its end.
struct RecordingEnd {
  frame::ReaderCounters frames{};
  ReaderFaults faults{};
  std::uint64_t bytes{};    // of the recording
  std::size_t cut_bytes{};  // of an incomplete last frame
  bool closed{};            // has the closing ledger of a STOP; otherwise samples from `next` on are unknown
  SampleIndex next{};
  std::optional<Balance> balance{};  // as of the last heartbeat
  std::uint64_t frames_missing{};    // by the gaps in their sequences
  std::uint64_t unexplained{};       // samples missing between frames of which none is missing
  bool triggers_exact{true};         // at every heartbeat
};

// State of a recording of which `bytes` were read.
RecordingEnd endOf(const StreamReader& reader, std::uint64_t bytes);

// Receives the bytes read so far and their total (0: unknown).
using ReadingProgress = std::function<void(std::uint64_t, std::uint64_t)>;

// Called after every piece of the recording; returns true to end the reading.
using EnoughRead = std::function<bool()>;

// Fails when the file cannot be read or holds no frame. "-" is the standard input.
Outcome<RecordingEnd> readRecording(const std::string& path, StreamListener& listener,
                                    const ReadingProgress& progress = {}, const EnoughRead& enough = {});
Outcome<RecordingEnd> readRecording(std::istream& in, StreamListener& listener, const ReadingProgress& progress = {},
                                    const EnoughRead& enough = {});

}  // namespace probebox::link
