#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/event_loop.hpp"
#include "firmware/stream/greeting.hpp"
#include "protocol/messages/status.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// Accepts TCP connections and passes them on once they have sent HELLO. Until then they occupy no link and little
// memory; those that send anything else first, or nothing for kPatience, are closed: a handshake of TLS is a part of
// that time. A host that gets no session receives a REFUSAL with the reason. One thread.
class ConnectionAcceptor {
 public:
  static constexpr Nanoseconds kPatience = std::chrono::seconds{2};
  // Connections that may wait for their HELLO at once; one more closes the oldest of the computer that has most of
  // them.
  static constexpr std::size_t kMostWaiting = 32;
  // Connections that one secured listener takes in one advance(): a handshake costs a signature, and the links of this
  // thread do not wait for many of them.
  static constexpr int kMostSecured = 4;

  // A host that has said HELLO.
  struct GreetedConnection {
    std::unique_ptr<io::BytePipe> pipe;
    stream::HelloGate gate;  // with the bytes received so far
    std::size_t listener{};  // index of the listener, in the order of listen()
  };
  struct Callbacks {
    std::function<std::optional<std::string>(std::size_t listener)> why_full;  // nullopt: there is room for one more
    std::function<void(GreetedConnection)> enter;
  };
  ConnectionAcceptor(EventLoop& loop, Callbacks callbacks) : loop_{loop}, callbacks_{std::move(callbacks)} {}

  // Puts TLS on a connection that has come; null where none can be served now.
  using Secure = std::function<std::unique_ptr<io::BytePipe>(std::unique_ptr<io::BytePipe>)>;
  // Call before open(). Returns the index of the listener. secure: of a listener that proves who comes; else empty.
  std::size_t listen(tcp::Listener listener, Secure secure = {});
  // Begins to accept connections.
  void open();
  // Call every few milliseconds: closes connections that have waited for too long.
  void advance(MonoTime now);
  void close();

  const messages::NotLetIn& counters() const { return counters_; }

 private:
  // A connection before its HELLO, or one that is being refused.
  struct PendingConnection {
    std::unique_ptr<io::BytePipe> pipe;
    stream::HelloGate gate;
    std::size_t listener{};
    MonoTime until{};
    EventLoop::Watch watch;
    bool refused{};
    bool over{};
  };

  struct Door {
    tcp::Listener listener;
    Secure secure;
  };

  void accept(std::size_t listener, int most);
  void makeRoom();
  void listenTo(PendingConnection& pending);
  void passOn(PendingConnection& pending);
  void refuse(PendingConnection& pending, const messages::Refusal& refusal);
  void closePending(PendingConnection& pending, std::uint64_t& counter, const std::string& why);

  EventLoop& loop_;
  Callbacks callbacks_;
  std::vector<Door> doors_;
  std::vector<EventLoop::Watch> watches_;
  std::vector<std::unique_ptr<PendingConnection>> pending_;
  messages::NotLetIn counters_;
  bool opened_{};
  MonoTime now_{};
  LimitedWarning warning_{std::chrono::seconds{10}};
};

}  // namespace probebox::app
