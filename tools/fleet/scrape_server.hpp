#pragma once
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "protocol/units/time.hpp"

namespace probebox::fleet {

// Answers GET /metrics over HTTP/1.1, one request a connection. Nothing blocks: a client that is slow, silent or says
// too much is closed, and holds up nobody.
class ScrapeServer {
 public:
  static constexpr std::size_t kMostConnections = 16;
  static constexpr std::size_t kMostHead_bytes = 8192;
  static constexpr Nanoseconds kPatience{5'000'000'000};

  explicit ScrapeServer(tcp::Listener listener) : listener_{std::move(listener)} {}

  const tcp::Address& address() const { return listener_.address(); }
  // To be watched for reading.
  std::vector<int> descriptors() const;
  // Answers whoever has asked, with what `metrics` returns.
  void round(MonoTime now, const std::function<std::string()>& metrics);

 private:
  struct Connection {
    std::unique_ptr<io::BytePipe> pipe;
    MonoTime since{};
    std::string head;
    std::string answer;  // what is left of it
    bool ended{};
  };
  static void serve(Connection& connection, const std::function<std::string()>& metrics);

  tcp::Listener listener_;
  std::list<Connection> connections_;
};

}  // namespace probebox::fleet
