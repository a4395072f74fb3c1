#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "firmware/app/results/activity.hpp"
#include "firmware/app/results/caller.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/update/bundle_file.hpp"
#include "firmware/app/update/updater.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/messages/updates.hpp"

namespace probebox::app {

// Receives a bundle from hosts, hands it to the updater, and says what comes of it. It installs nothing itself: it has
// no right to. For the worker's thread, but for inWords().
class UpdateRequestHandler {
 public:
  using Clock = std::chrono::steady_clock;
  struct Dependencies {
    std::function<Activity()> activity;
    std::function<void()> look_again;  // calls look() soon
    std::function<bool()> confirmed;   // true once the running version has been found healthy
  };
  static constexpr std::chrono::seconds kAbandoned{30};  // another bundle may be offered after this silence
  static constexpr std::chrono::minutes kUntaken{10};    // the updater has to take a request within this time
  // It reports before it removes a request, and is ended after half an hour.
  static constexpr std::chrono::minutes kUnreported{40};

  // folder: for the bundle. reports: folder of the updater; empty where the box has none, and nothing is touched then.
  UpdateRequestHandler(const std::filesystem::path& folder, const std::filesystem::path& reports,
                       Dependencies dependencies);

  static bool answers(messages::Operation operation);
  Reply answer(messages::Operation operation, std::span<const std::byte> body, const Caller& caller,
               Clock::time_point now = Clock::now());
  // Call periodically: goes on with what takes time.
  void look(Clock::time_point now = Clock::now());

  // How far an update is, or what came of the last one; empty for none. Any thread.
  std::string inWords() const;

 private:
  // Present only on a box with an updater.
  struct Parts {
    Updater updater;
    BundleFile file;
  };
  struct Asked {
    std::uint64_t installation{};
    bool although_not_newer{};
  };

  Reply offer(std::span<const std::byte> body, Clock::time_point now);
  Reply send(std::span<const std::byte> body, Clock::time_point now);
  Reply install(std::span<const std::byte> body);
  Reply status();
  messages::UpdateStatus::Answer current() const;
  std::optional<Error> whyNotNow() const;
  std::optional<Reply> whyNotThis(std::uint32_t offer) const;
  void check(Clock::time_point now);
  void follow(Clock::time_point now);
  void end(const std::string& why);
  void tellWords();

  Dependencies deps_;
  std::optional<Parts> parts_;
  std::uint32_t offer_{};  // 0: none since the start, or it has ended
  std::uint32_t last_offer_{};
  Clock::time_point heard_{};      // the last part
  Clock::time_point stored_at_{};  // the last part that was stored
  std::optional<Asked> checking_;
  Clock::time_point handed_over_{};
  Clock::time_point followed_{};
  bool restart_asked_{};
  // The last installation that ended before the updater had it.
  std::uint64_t failed_installation_{};
  std::string why_failed_;
  std::optional<UpdaterReport> report_;
  mutable std::mutex mutex_;
  std::string words_;
};

}  // namespace probebox::app
