#include "host-tests/faults/supervised.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/io/descriptor.hpp"

namespace probebox::faults {
namespace {

using Clock = std::chrono::steady_clock;

// Every call of fileCalls() waits for the supervisor, all others pass. Returns where it listens, or -1.
int listenToOwnCalls() {
  std::vector<sock_filter> steps{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const auto number : fileCalls()) {
    steps.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(number), 0, 1));
    steps.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF));
  }
  steps.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  const sock_fprog filter{static_cast<unsigned short>(steps.size()), steps.data()};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return -1;
  return static_cast<int>(::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &filter));
}

void sendDescriptor(int socket, int descriptor) {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
  char byte = descriptor >= 0 ? 'y' : 'n';
  iovec part{.iov_base = &byte, .iov_len = 1};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  if (descriptor >= 0) {
    message.msg_control = room.data();
    message.msg_controllen = room.size();
    cmsghdr* head = CMSG_FIRSTHDR(&message);
    head->cmsg_level = SOL_SOCKET;
    head->cmsg_type = SCM_RIGHTS;
    head->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(head), &descriptor, sizeof descriptor);
  }
  ::sendmsg(socket, &message, 0);
}

io::Descriptor receiveDescriptor(int socket) {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
  char byte = 0;
  iovec part{.iov_base = &byte, .iov_len = 1};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = room.data();
  message.msg_controllen = room.size();
  const auto got = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  const cmsghdr* head = got == 1 ? CMSG_FIRSTHDR(&message) : nullptr;
  int descriptor = -1;
  if (head != nullptr) std::memcpy(&descriptor, CMSG_DATA(head), sizeof descriptor);
  return io::Descriptor{descriptor};
}

[[noreturn]] void runAndExit(int socket, const std::function<void(const Say&)>& run) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  // A box under faults logs every one of them.
  [[maybe_unused]] const auto* const silenced = std::freopen("/dev/null", "w", stderr);
  const int listener = listenToOwnCalls();
  sendDescriptor(socket, listener);
  if (listener < 0) ::_exit(1);
  char go = 0;
  ::recv(socket, &go, 1, 0);
  run([socket](std::string_view line) { ::send(socket, line.data(), line.size(), MSG_NOSIGNAL); });
  ::_exit(0);
}

class Supervision {
 public:
  Supervision(const std::filesystem::path& folder, const std::function<void(const Say&)>& run) : folder_{folder} {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw std::runtime_error{std::string{"No socket: "} + std::strerror(errno)};
    socket_ = io::Descriptor{ends[0]};
    io::Descriptor theirs{ends[1]};
    process_ = ::fork();
    if (process_ < 0) throw std::runtime_error{std::string{"No process: "} + std::strerror(errno)};
    if (process_ == 0) {
      socket_.close();
      runAndExit(theirs.get(), run);
    }
    theirs.close();
    listener_ = receiveDescriptor(socket_.get());
  }
  ~Supervision() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  Supervision(const Supervision&) = delete;
  Supervision& operator=(const Supervision&) = delete;

  bool listens() const { return static_cast<bool>(listener_); }

  Ended serve(const std::function<Decision(const Call&)>& decide) {
    ::send(socket_.get(), "g", 1, MSG_NOSIGNAL);
    const auto until = Clock::now() + kPatience;
    while (true) {
      std::array<pollfd, 2> waiting{pollfd{.fd = listener_.get(), .events = POLLIN, .revents = 0},
                                    pollfd{.fd = socket_.get(), .events = POLLIN, .revents = 0}};
      ::poll(waiting.data(), waiting.size(), 1000);
      const bool heard = waiting[1].revents != 0 && hear();
      if ((waiting[0].revents & POLLIN) != 0 && !answer(decide)) break;
      if ((waiting[1].revents & POLLHUP) != 0 && !heard) break;  // it has ended
      if (Clock::now() < until) continue;
      ended_.hung = true;
      ::kill(process_, SIGKILL);
      break;
    }
    ::waitpid(std::exchange(process_, -1), &ended_.status, 0);
    while (hear()) {
    }
    return std::move(ended_);
  }

 private:
  bool hear() {
    std::array<char, 4096> line{};
    const auto got = ::recv(socket_.get(), line.data(), line.size(), MSG_DONTWAIT);
    if (got > 0) ended_.said.emplace_back(line.data(), static_cast<std::size_t>(got));
    return got > 0;
  }

  // False once the process was killed.
  bool answer(const std::function<Decision(const Call&)>& decide) {
    seccomp_notif asked{};
    if (::ioctl(listener_.get(), SECCOMP_IOCTL_NOTIF_RECV, &asked) != 0) return true;
    seccomp_notif_resp answer{.id = asked.id, .val = 0, .error = 0, .flags = SECCOMP_USER_NOTIF_FLAG_CONTINUE};
    const auto call = decode(asked);
    if (call && isInside(call->path)) {
      const auto decision = decide(*call);
      if (decision.what == Decision::What::kill) {
        ::kill(process_, SIGKILL);
        ended_.killed = true;
        return false;
      }
      if (decision.what == Decision::What::fail)
        answer = {.id = asked.id, .val = 0, .error = -decision.error, .flags = 0};
      if (decision.what == Decision::What::shorten)
        answer = {.id = asked.id, .val = writtenFor(asked.pid, *call), .error = 0, .flags = 0};
      if (decision.what == Decision::What::pass && call->kind == Call::Kind::sync) answer.flags = 0;
    }
    ::ioctl(listener_.get(), SECCOMP_IOCTL_NOTIF_SEND, &answer);
    return true;
  }

  bool isInside(const std::string& path) const { return path == folder_ || path.starts_with(folder_ + "/"); }

  // The first half of a write, by another description of the same file.
  static std::int64_t writtenFor(std::uint32_t process, const Call& call) {
    const auto name = "/proc/" + std::to_string(process) + "/fd/" + std::to_string(call.descriptor);
    const io::Descriptor file{::open(name.c_str(), O_WRONLY | O_CLOEXEC)};
    return ::pwrite(file.get(), call.bytes.data(), call.bytes.size() / 2, static_cast<off_t>(call.offset));
  }

  std::string folder_;
  io::Descriptor socket_;
  io::Descriptor listener_;
  pid_t process_{-1};
  Ended ended_;
};

}  // namespace

std::string whyNoSupervision() {
  const Supervision trial{"/", [](const Say&) {}};
  return trial.listens() ? "" : "The kernel gives no seccomp notifications to this process.";
}

Ended supervise(const std::filesystem::path& folder, const std::function<void(const Say&)>& run,
                const std::function<Decision(const Call&)>& decide) {
  Supervision supervision{folder, run};
  if (!supervision.listens()) throw std::runtime_error{whyNoSupervision()};
  return supervision.serve(decide);
}

}  // namespace probebox::faults
