#include "tools/link/recording.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "protocol/units/plain_input.hpp"

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

RecordingEnd endOf(const StreamReader& reader, std::uint64_t bytes) {
  const auto& ledger = reader.ledger();
  return RecordingEnd{.frames = reader.counters(),
                      .faults = reader.faults(),
                      .bytes = bytes,
                      .cut_bytes = reader.unfinished(),
                      .closed = ledger.closed(),
                      .next = ledger.next(),
                      .balance = ledger.balance(),
                      .frames_missing = ledger.framesMissing(),
                      .unexplained = ledger.unexplained(),
                      .triggers_exact = reader.triggers().exact()};
}

Outcome<RecordingEnd> readRecording(std::istream& in, StreamListener& listener, const ReadingProgress& progress,
                                    const EnoughRead& enough) {
  StreamReader reader{listener};
  std::array<std::byte, 65536> buffer{};
  std::uint64_t bytes = 0;
  while (in && !(enough && enough())) {
    in.read(reinterpret_cast<char*>(buffer.data()), static_cast<std::streamsize>(buffer.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    reader.read(std::span{buffer}.first(got));
    bytes += got;
    if (progress) progress(bytes, 0);
  }
  if (reader.counters().frames == 0) {
    return Error{"there is no frame of a probebox recording in it; name a file that 'probebox record' wrote"};
  }
  return endOf(reader, bytes);
}

Outcome<RecordingEnd> readRecording(const std::string& path, StreamListener& listener, const ReadingProgress& progress,
                                    const EnoughRead& enough) {
  if (path == "-") return readRecording(std::cin, listener, progress, enough);
  TRY(auto file, openPlainInput(path));
  std::error_code unknown;
  const auto size = std::filesystem::file_size(path, unknown);
  const auto of_file = [&](std::uint64_t done, std::uint64_t) { progress(done, unknown ? 0 : size); };
  auto end = readRecording(file, listener, progress ? ReadingProgress{of_file} : ReadingProgress{}, enough);
  if (!end) return Error{path + ": " + end.error().what};
  return end;
}

}  // namespace probebox::link
