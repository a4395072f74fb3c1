#pragma once
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "protocol/events/event.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/units/outcome.hpp"

// Writes every event of the core, in order, as frames to a file that stays readable when cut at any byte.
namespace probebox::app {

class JournalWriter {
 public:
  static Outcome<JournalWriter> create(const std::filesystem::path& path);

  // Returns false on a write error, which ends the journal.
  bool write(const Event& event);
  // Counts events that never reached the writer; the reader sees the gap.
  void skip(std::uint64_t events) { sequence_ += static_cast<std::uint32_t>(events); }
  void flush();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  explicit JournalWriter(std::FILE* file);

  std::unique_ptr<std::FILE, Close> file_;
  std::vector<std::byte> payload_;
  std::vector<std::byte> scratch_;
  std::vector<std::byte> frame_;
  std::uint32_t sequence_{};
};

struct JournalEnd {
  std::uint64_t events{};
  std::uint64_t lost{};  // events missing by the frame sequence, or damaged
};

// Calls `take` for every readable event, in order.
Outcome<JournalEnd> readJournal(const std::filesystem::path& path, const std::function<void(const Event&)>& take);

}  // namespace probebox::app
