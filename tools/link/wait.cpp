#include "tools/link/wait.hpp"

#include <poll.h>

namespace probebox::link {
namespace {
// Short, so that time-driven duties of a client (signs of life, requests asked again) are done while nothing arrives.
constexpr int kSliceMs = 20;
}  // namespace

MonoTime now() {
  return monoTime(std::chrono::duration_cast<Nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

Wait patience(std::chrono::milliseconds limit, const std::atomic<bool>* interrupted) {
  const auto deadline = now() + limit;
  return [deadline, interrupted](int descriptor, bool for_writing) -> std::optional<MonoTime> {
    if (interrupted != nullptr && interrupted->load()) return std::nullopt;
    if (now() >= deadline) return std::nullopt;
    pollfd watched{descriptor, static_cast<short>(POLLIN | (for_writing ? POLLOUT : 0)), 0};
    ::poll(&watched, 1, kSliceMs);
    return now();
  };
}

}  // namespace probebox::link
