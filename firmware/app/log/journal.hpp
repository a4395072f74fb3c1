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

// Every event that the core took, in its order, as frames of a file that stays readable when it is cut at any byte.
namespace probebox::app {

class JournalWriter {
 public:
  static Outcome<JournalWriter> create(const std::filesystem::path& path);

  // False when the disk does not take it: the journal ends there.
  bool write(const Event& event);
  // Events that never reached the writer: the reader sees the gap.
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
  std::uint64_t lost{};  // by the gaps in the frame sequence, or damaged
};

// Calls `take` for every event that can be read, in order.
Outcome<JournalEnd> readJournal(const std::filesystem::path& path, const std::function<void(const Event&)>& take);

}  // namespace probebox::app
