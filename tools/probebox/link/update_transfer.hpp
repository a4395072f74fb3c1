#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "protocol/units/time.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/bundle_to_send.hpp"

namespace probebox::command {

// Fewer repetitions than usual: a part of a bundle takes its time on a slow line.
inline constexpr link::ClientOptions kUpdateLink{.retry_period = std::chrono::seconds{2}};

// Sends what the box lacks of a bundle over one link. Several parts are on their way at once, as many as the line takes
// within a fraction of a second: other requests and samples pass between them.
class UpdateTransfer {
 public:
  // progress: called with the bytes that the box holds.
  UpdateTransfer(link::Client& box, BundleToSend& bundle, Console& console, std::function<void(std::uint64_t)> progress)
      : box_{box}, bundle_{bundle}, console_{console}, progress_{std::move(progress)} {}

  // Returns the offer by which the box knows the complete bundle.
  Outcome<std::uint32_t, Trouble> run();
  std::uint64_t sentBytes() const { return sent_; }

 private:
  struct Part {
    std::uint32_t id{};
    std::uint64_t end{};  // offset in the bundle
    std::size_t bytes{};
    MonoTime sent_at{};
  };
  std::optional<Trouble> fill();
  std::optional<Trouble> collect();
  void pace(Nanoseconds round_trip, std::size_t bytes);

  link::Client& box_;
  BundleToSend& bundle_;
  Console& console_;
  std::function<void(std::uint64_t)> progress_;
  std::uint32_t offer_{};
  std::deque<Part> under_way_;
  std::size_t window_{1000};  // bytes under way at most
  std::size_t bytes_under_way_{};
  std::uint64_t next_{};
  std::uint64_t held_{};  // by the box
  bool goes_back_{};      // the box lacks a part before those under way
  std::uint64_t sent_{};
};

}  // namespace probebox::command
