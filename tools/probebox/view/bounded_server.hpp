#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <httplib.h>
#include <poll.h>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace probebox::view {

// Later versions of the library have a limit of their own.
#ifdef CPPHTTPLIB_HEADER_MAX_COUNT
using BoundedServer = httplib::Server;
#else

inline constexpr std::size_t kMostHead_bytes = 65'536;

// A connection whose requests may have a head, the request line and the header fields, of kMostHead_bytes: a longer one
// is answered by 431, and nothing more is read. A head that is not whole after `silent_ms` ends the connection: one
// that sends a byte now and then would hold its thread for hours.
class BoundedStream : public httplib::Stream {
 public:
  BoundedStream(socket_t socket, int silent_ms) : socket_{socket}, silent_ms_{silent_ms} {}

  void beginRequest() {
    head_bytes_ = 0, in_head_ = true, line_is_empty_ = false, is_answered_ = false;
    head_until_ = Clock::now() + std::chrono::milliseconds{silent_ms_};
  }
  // The answer says that the connection ends with it: a body that nobody has read would be taken for the next request.
  bool endsWithAnswer() const { return ends_; }
  bool isTooLong() const { return head_bytes_ > kMostHead_bytes; }
  bool awaits(int at_most_ms) const { return next_ < end_ || is(POLLIN, at_most_ms); }

  bool is_readable() const override { return awaits(silent_ms_); }
  bool is_writable() const override { return !isTooLong() && is(POLLOUT, silent_ms_); }
  ssize_t read(char* to, size_t size) override {
    if (isTooLong() || !fill()) return -1;
    const std::size_t count = std::min(size, end_ - next_);
    std::copy_n(buffer_.data() + next_, count, to);
    next_ += count;
    if (in_head_) take({to, count});
    return isTooLong() ? -1 : static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    if (!std::exchange(is_answered_, true))
      ends_ = std::string_view{from, size}.find("\r\nConnection: close\r\n") != std::string_view::npos;
    return is_writable() ? ::send(socket_, from, size, MSG_NOSIGNAL) : -1;
  }
  // All of them are from this computer, and nobody asks.
  void get_remote_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  void get_local_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  socket_t socket() const override { return socket_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool is(short ready, int within_ms) const {
    pollfd one{.fd = socket_, .events = ready, .revents = 0};
    return ::poll(&one, 1, within_ms) > 0;
  }
  bool fill() {
    if (next_ < end_) return true;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(head_until_ - Clock::now()).count();
    if (in_head_ && (left <= 0 || !is(POLLIN, static_cast<int>(left)))) return false;
    if (!is_readable()) return false;
    const auto got = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
    next_ = 0, end_ = got > 0 ? static_cast<std::size_t>(got) : 0;
    return got > 0;
  }
  // The head ends with an empty line.
  void take(std::string_view bytes) {
    for (const char byte : bytes) {
      ++head_bytes_;
      if (byte == '\n' && line_is_empty_) in_head_ = false, head_bytes_ = 0;
      if (byte != '\r') line_is_empty_ = byte == '\n';
      if (!in_head_) return;
    }
    if (isTooLong()) refuse();
  }
  // Read on for a moment: a connection that is closed before would be reset, and the answer lost.
  void refuse() {
    constexpr std::string_view kAnswer = "HTTP/1.1 431 Request Header Fields Too Large\r\nConnection: close\r\n\r\n";
    constexpr int kMostReads = 4096, kWait_ms = 100;
    ::send(socket_, kAnswer.data(), kAnswer.size(), MSG_NOSIGNAL);
    ::shutdown(socket_, SHUT_WR);
    for (int k = 0; k < kMostReads && is(POLLIN, kWait_ms); ++k)
      if (::recv(socket_, buffer_.data(), buffer_.size(), 0) <= 0) return;
  }

  socket_t socket_;
  int silent_ms_;
  Clock::time_point head_until_{};
  std::array<char, 4096> buffer_{};
  std::size_t next_{}, end_{};
  std::size_t head_bytes_{};
  bool in_head_{}, line_is_empty_{};
  bool is_answered_{}, ends_{};
};

class BoundedServer : public httplib::Server {
 private:
  bool process_and_close_socket(socket_t socket) override {
    constexpr int kPart_ms = 100, kSecond_ms = 1000;
    BoundedStream stream{socket, static_cast<int>(read_timeout_sec_) * kSecond_ms};
    bool is_good = true, is_closed = false;
    for (auto left = keep_alive_max_count_; left > 0 && is_good && !is_closed; --left) {
      auto parts = static_cast<int>(keep_alive_timeout_sec_) * kSecond_ms / kPart_ms;
      while (parts > 0 && svr_sock_ != INVALID_SOCKET && !stream.awaits(kPart_ms)) --parts;
      if (parts == 0 || svr_sock_ == INVALID_SOCKET) break;
      stream.beginRequest();
      is_good = process_request(stream, left == 1, is_closed, {}) && !stream.isTooLong() && !stream.endsWithAnswer();
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return is_good;
  }
};
#endif

}  // namespace probebox::view
