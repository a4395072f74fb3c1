#include "drivers/tcp/linux_tcp.hpp"

#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <optional>
#include <poll.h>
#include <sys/socket.h>
#include <utility>

namespace probebox::tcp {
namespace {

class TcpPipe final : public io::BytePipe {
 public:
  TcpPipe(io::Descriptor socket, std::string name) : socket_{std::move(socket)}, name_{std::move(name)} {
    const int on = 1;
    setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(socket_.get(), SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  }

  io::Transfer read(std::span<std::byte> into) override {
    if (into.empty()) return {0, state_};
    const auto bytes = recv(socket_.get(), into.data(), into.size(), MSG_DONTWAIT);
    if (bytes == 0) state_ = io::PipeState::closed;
    return moved(bytes);
  }
  io::Transfer write(std::span<const std::byte> from) override {
    if (from.empty()) return {0, state_};
    return moved(send(socket_.get(), from.data(), from.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
  }
  int descriptor() const override { return socket_.get(); }
  std::string_view name() const override { return name_; }

 private:
  io::Transfer moved(ssize_t bytes) {
    if (bytes >= 0) return {static_cast<std::size_t>(bytes), state_};
    if (errno != EAGAIN && errno != EINTR) state_ = io::PipeState::closed;
    return {0, state_};
  }

  io::Descriptor socket_;
  std::string name_;
  io::PipeState state_{io::PipeState::open};
};

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using Resolved = std::unique_ptr<addrinfo, FreeAddresses>;

Outcome<Resolved> resolve(const Address& address, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* list = nullptr;
  const int code = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (code != 0) return Error{describe(address) + ": " + gai_strerror(code) + "; check the name of the host"};
  return Resolved{list};
}

Address addressOf(const sockaddr_storage& socket_address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (socket_address.ss_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &socket_address, sizeof v6);
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
    return {text.data(), ntohs(v6.sin6_port)};
  }
  sockaddr_in v4{};
  std::memcpy(&v4, &socket_address, sizeof v4);
  inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  return {text.data(), ntohs(v4.sin_port)};
}

io::Descriptor socketFor(const addrinfo& where) {
  return io::Descriptor{socket(where.ai_family, where.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, where.ai_protocol)};
}

// 0, or the reason (errno) why the connection did not come about.
int waitForConnection(int socket, std::chrono::milliseconds patience) {
  pollfd wait{socket, POLLOUT, 0};
  int ready = 0;
  do {
    ready = poll(&wait, 1, static_cast<int>(patience.count()));
  } while (ready < 0 && errno == EINTR);
  if (ready == 0) return ETIMEDOUT;
  int code = 0;
  socklen_t size = sizeof code;
  getsockopt(socket, SOL_SOCKET, SO_ERROR, &code, &size);
  return code;
}

std::string remedy(int code) {
  switch (code) {
    case EADDRINUSE:
      return "; another process listens there, stop it or use another port";
    case EADDRNOTAVAIL:
      return "; this machine does not have that address, use 127.0.0.1 or 0.0.0.0";
    case EACCES:
      return "; ports below 1024 need privileges, use a higher one";
    case ECONNREFUSED:
      return "; nothing listens there, start probeboxd or check the port";
    case EAFNOSUPPORT:
      return "; this process may not open network sockets, let a socket unit of its service listen there";
    case ETIMEDOUT:
      return "; check that the box is on and reachable";
    default:
      return "";
  }
}

Error failure(const Address& address, int code) {
  return {"tcp:" + describe(address) + ": " + std::strerror(code) + remedy(code)};
}

std::optional<Address> boundTo(const io::Descriptor& socket) {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  if (getsockname(socket.get(), reinterpret_cast<sockaddr*>(&bound), &size) != 0) return std::nullopt;
  return addressOf(bound);
}

bool optionOf(const io::Descriptor& socket, int option, int& value) {
  socklen_t size = sizeof value;
  return getsockopt(socket.get(), SOL_SOCKET, option, &value, &size) == 0;
}

}  // namespace

Outcome<Listener> Listener::open(const Address& address) {
  TRY(const auto resolved, resolve(address, AI_PASSIVE));
  int code = EADDRNOTAVAIL;
  for (const auto* where = resolved.get(); where != nullptr; where = where->ai_next) {
    auto socket = socketFor(*where);
    const int on = 1;
    if (socket) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (!socket || bind(socket.get(), where->ai_addr, where->ai_addrlen) != 0 || listen(socket.get(), 16) != 0) {
      code = errno;
      continue;
    }
    const auto bound = boundTo(socket);
    if (!bound) return failure(address, errno);
    return Listener{std::move(socket), *bound};
  }
  return failure(address, code);
}

Outcome<Listener> Listener::adopt(io::Descriptor socket, std::string_view name) {
  int family = 0;
  int type = 0;
  int listening = 0;
  const bool is_listener = optionOf(socket, SO_DOMAIN, family) && (family == AF_INET || family == AF_INET6) &&
                           optionOf(socket, SO_TYPE, type) && type == SOCK_STREAM &&
                           optionOf(socket, SO_ACCEPTCONN, listening) && listening != 0;
  const auto bound = boundTo(socket);
  if (!is_listener || !bound || fcntl(socket.get(), F_SETFL, O_NONBLOCK) != 0) {
    return Error{"'" + std::string{name} +
                 "' was passed to this process and is no listening TCP socket: its socket unit needs "
                 "ListenStream=HOST:PORT and Accept=no"};
  }
  return Listener{std::move(socket), *bound};
}

std::unique_ptr<io::BytePipe> Listener::accept() {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  io::Descriptor socket{
      accept4(socket_.get(), reinterpret_cast<sockaddr*>(&peer), &size, SOCK_NONBLOCK | SOCK_CLOEXEC)};
  if (!socket) return nullptr;
  return std::make_unique<TcpPipe>(std::move(socket), "tcp:" + describe(addressOf(peer)));
}

Outcome<std::unique_ptr<io::BytePipe>> connectTcp(const Address& address, std::chrono::milliseconds patience) {
  TRY(const auto resolved, resolve(address, 0));
  int code = ECONNREFUSED;
  for (const auto* where = resolved.get(); where != nullptr; where = where->ai_next) {
    auto socket = socketFor(*where);
    code = socket && connect(socket.get(), where->ai_addr, where->ai_addrlen) == 0 ? 0 : errno;
    if (code == EINPROGRESS) code = waitForConnection(socket.get(), patience);
    if (code == 0) {
      return std::unique_ptr<io::BytePipe>{std::make_unique<TcpPipe>(std::move(socket), "tcp:" + describe(address))};
    }
  }
  return failure(address, code);
}

}  // namespace probebox::tcp
