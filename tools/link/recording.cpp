#include "tools/link/recording.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>

namespace probebox::link {

RecordingWriter::RecordingWriter(std::ostream& out) : out_{out} {}

bool RecordingWriter::write(const frame::Frame& frame) {
  scratch_.resize(frame::bareSize(frame.payload.size()));
  coded_.resize(frame::delimitedMaxSize(frame.payload.size()));
  const auto size = frame::encodeDelimited(frame.header, frame.payload, scratch_, coded_);
  out_.write(reinterpret_cast<const char*>(coded_.data()), static_cast<std::streamsize>(size));
  bytes_ += size;
  return out_.good();
}

Outcome<RecordingEnd> readRecording(std::istream& in, StreamListener& listener) {
  StreamReader reader{listener};
  std::array<std::byte, 65536> buffer{};
  while (in) {
    in.read(reinterpret_cast<char*>(buffer.data()), static_cast<std::streamsize>(buffer.size()));
    reader.read(std::span{buffer}.first(static_cast<std::size_t>(in.gcount())));
  }
  if (reader.counters().frames == 0) {
    return Error{"there is no frame of a probebox recording in it; name a file that 'probebox record' wrote"};
  }
  const auto& ledger = reader.ledger();
  return RecordingEnd{reader.counters(), reader.faults(), reader.unfinished(),
                      ledger.closed(),   ledger.next(),   ledger.balance()};
}

Outcome<RecordingEnd> readRecording(const std::string& path, StreamListener& listener) {
  if (path == "-") return readRecording(std::cin, listener);
  std::ifstream file{path, std::ios::binary};
  if (!file) return Error{path + ": cannot be read (" + std::strerror(errno) + ")"};
  auto end = readRecording(file, listener);
  if (!end) return Error{path + ": " + end.error().what};
  return end;
}

}  // namespace probebox::link
