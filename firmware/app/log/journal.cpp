#include "firmware/app/log/journal.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "protocol/messages/fields.hpp"

namespace probebox::app {
namespace {

// Frame types from here on are never sent over a link.
constexpr std::uint8_t kEventFrame = 0x40;
constexpr std::size_t kLargestEvent = 512;

std::string withReason(const char* what, const std::filesystem::path& path) {
  return std::string{what} + " " + path.string() + ": " + std::strerror(errno) + ".";
}

}  // namespace

JournalWriter::JournalWriter(std::FILE* file)
    : file_{file},
      payload_(kLargestEvent),
      scratch_(frame::bareSize(kLargestEvent)),
      frame_(frame::delimitedMaxSize(kLargestEvent)) {}

Outcome<JournalWriter> JournalWriter::create(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "wbex");
  if (file == nullptr)
    return Error{withReason("Cannot create the journal", path) + " Name a file that does not exist yet."};
  return JournalWriter{file};
}

bool JournalWriter::write(const Event& event) {
  const auto size = messages::encode(event, payload_);
  if (!size) return false;
  const frame::Header header{.type = kEventFrame, .sequence = sequence_++};
  const std::size_t bytes = frame::encodeDelimited(header, std::span{payload_}.first(*size), scratch_, frame_);
  return std::fwrite(frame_.data(), 1, bytes, file_.get()) == bytes;
}

void JournalWriter::flush() {
  std::fflush(file_.get());
}

Outcome<JournalEnd> readJournal(const std::filesystem::path& path, const std::function<void(const Event&)>& take) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{std::fopen(path.c_str(), "rbe"), &std::fclose};
  if (!file) return Error{withReason("Cannot read the journal", path)};
  frame::Reader reader{kLargestEvent};
  JournalEnd end;
  std::uint32_t expected = 0;
  std::array<std::byte, 65536> buffer;
  while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), file.get())) {
    std::span<const std::byte> bytes{buffer.data(), got};
    while (!bytes.empty()) {
      const auto frame = reader.next(bytes);
      if (!frame || frame->header.type != kEventFrame) continue;
      end.lost += frame->header.sequence - expected;
      expected = frame->header.sequence + 1;
      const auto event = messages::decode<Event>(frame->payload);
      if (!event) {
        ++end.lost;
        continue;
      }
      ++end.events;
      take(*event);
    }
  }
  return end;
}

}  // namespace probebox::app
