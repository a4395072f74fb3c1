#pragma once
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <optional>
#include <random>
#include <string>

#include "firmware/app/update/update_request_handler.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {

inline constexpr board::Access kMayUpdate{.allow_update = true};

inline std::string bundleBytes(std::size_t size, unsigned seed = 1) {
  std::mt19937 random{seed};
  std::string all(size, '\0');
  for (auto& each : all) each = static_cast<char>(random());
  return all;
}

inline messages::Sha256 sha256Of(const std::string& bytes) {
  frame::Sha256 hash;
  hash.add(std::as_bytes(std::span{bytes}));
  return hash.digest();
}

inline std::string textIn(const std::filesystem::path& path) {
  std::ifstream in{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

// A handler that can be started again as after a kill, and a host that sends a bundle to it.
class SentBundle {
 public:
  explicit SentBundle(const std::filesystem::path& where, bool has_updater = true)
      : folder{where}, has_updater_{has_updater} {
    std::error_code cannot;  // on a faulty disk
    std::filesystem::create_directories(reports(), cannot);
    restart();
  }

  std::filesystem::path requests() const { return folder / "update"; }
  std::filesystem::path reports() const { return folder / "reports"; }
  void restart() {
    handler.reset();
    handler.emplace(requests(), has_updater_ ? reports() : std::filesystem::path{},
                    UpdateRequestHandler::Dependencies{[this] { return machine; }, [this] { look_again = true; },
                                                       [this] { return confirmed; }});
  }

  template <class Operation>
  Reply ask(const typename Operation::Request& request) {
    return handler->answer(Operation::kOperation, messages::encoded(request),
                           {.link = 1, .connection = "usb", .may = may}, now);
  }
  template <class Operation>
  typename Operation::Answer answered(const typename Operation::Request& request) {
    const auto reply = ask<Operation>(request);
    EXPECT_EQ(reply.code, messages::ErrorCode::ok) << reply.text;
    return messages::decode<typename Operation::Answer>(reply.body).value();
  }
  Reply offerReply(const std::string& bytes, std::optional<messages::Sha256> sha256 = std::nullopt) {
    return ask<messages::OfferUpdate>(
        {.name = "box.raucb", .version = "2", .total_bytes = bytes.size(), .sha256 = sha256.value_or(sha256Of(bytes))});
  }
  // What the box holds already.
  std::uint64_t offer(const std::string& bytes, std::optional<messages::Sha256> sha256 = std::nullopt) {
    const auto reply = offerReply(bytes, sha256);
    EXPECT_EQ(reply.code, messages::ErrorCode::ok) << reply.text;
    const auto answer = messages::decode<messages::OfferUpdate::Answer>(reply.body).value();
    offered = answer.offer;
    return answer.received_bytes;
  }
  Reply send(const std::string& bytes, std::size_t offset, std::size_t count) {
    const auto part = std::as_bytes(std::span{bytes}).subspan(offset, std::min(count, bytes.size() - offset));
    return ask<messages::SendUpdate>({.offer = offered, .offset = offset, .bytes = {part.begin(), part.end()}});
  }
  void sendAll(const std::string& bytes, std::size_t from = 0) {
    for (std::size_t at = from; at < bytes.size(); at += messages::kMostUpdateBytes) {
      const auto reply = send(bytes, at, messages::kMostUpdateBytes);
      ASSERT_EQ(reply.code, messages::ErrorCode::ok) << reply.text;
    }
  }
  std::uint64_t install(bool although_not_newer = false) {
    return answered<messages::InstallUpdate>({.offer = offered, .although_not_newer = although_not_newer}).installation;
  }
  messages::UpdateStatus::Answer status() { return answered<messages::UpdateStatus>({}); }
  // Lets the handler do what takes time, and the clock go on.
  void look(std::chrono::milliseconds later = std::chrono::seconds{1}) {
    now += later;
    do {
      look_again = false;
      handler->look(now);
    } while (look_again);
  }
  void report(const std::string& lines) { std::ofstream{reports() / "state"} << lines; }

  std::filesystem::path folder;
  Activity machine;
  bool confirmed{true};
  board::Access may{kMayUpdate};
  UpdateRequestHandler::Clock::time_point now{UpdateRequestHandler::Clock::now()};
  std::uint32_t offered{};
  bool look_again{};
  std::optional<UpdateRequestHandler> handler;

 private:
  bool has_updater_{};
};

}  // namespace probebox::app
