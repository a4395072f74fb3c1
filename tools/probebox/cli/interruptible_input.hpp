#pragma once
#include <array>
#include <atomic>
#include <cerrno>
#include <poll.h>
#include <streambuf>
#include <unistd.h>

namespace probebox::command {

// Reads a descriptor until its end or Ctrl-C. A std::ifstream would stay blocked on a silent pipe after Ctrl-C.
class InterruptibleInput : public std::streambuf {
 public:
  InterruptibleInput(int descriptor, const std::atomic<bool>& interrupted)
      : descriptor_{descriptor}, interrupted_{interrupted} {}

 protected:
  int_type underflow() override {
    constexpr int kGlance_ms = 100;  // bounds the delay when the signal comes just before poll()
    pollfd input{.fd = descriptor_, .events = POLLIN, .revents = 0};
    while (!interrupted_) {
      if (poll(&input, 1, kGlance_ms) <= 0) continue;
      const auto got = read(descriptor_, buffer_.data(), buffer_.size());
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (got <= 0) break;
      setg(buffer_.data(), buffer_.data(), buffer_.data() + got);
      return traits_type::to_int_type(buffer_.front());
    }
    return traits_type::eof();
  }

 private:
  int descriptor_;
  const std::atomic<bool>& interrupted_;
  std::array<char, 65536> buffer_{};
};

}  // namespace probebox::command
