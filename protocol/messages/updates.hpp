#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Hands a bundle of new firmware to the box.
namespace probebox::messages {

// Bytes of a bundle in one request, which has to fit into a frame of 4096 bytes.
inline constexpr std::size_t kMostUpdateBytes = 4000;

using Sha256 = std::array<std::uint8_t, 32>;

// Announces a bundle. The box answers with what it holds of exactly this bundle already, also after a restart of it.
struct OfferUpdate {
  static constexpr Operation kOperation = Operation::offer_update;
  struct Request {
    std::string name{};
    std::string version{};
    std::uint64_t total_bytes{};
    Sha256 sha256{};
    static constexpr void fields(auto& self, auto&& field) {
      field("name", self.name, "of its file, for a person");
      field("version", self.version, "of its manifest as the host reads it, for a person; empty when not known");
      field("total_bytes", self.total_bytes, "size of the bundle");
      field("sha256", self.sha256, "of the whole bundle");
    }
  };
  struct Answer {
    std::uint32_t offer{};
    std::uint64_t received_bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("offer", self.offer, "names this offer until the box restarts or takes another bundle");
      field("received_bytes", self.received_bytes, "what the box holds from the beginning on: go on there");
    }
  };
};

// Sends a part of the bundle. Parts may be sent again, and several may be on their way. A part that begins behind what
// the box holds is not taken: the answer says where to go on.
struct SendUpdate {
  static constexpr Operation kOperation = Operation::send_update;
  struct Request {
    std::uint32_t offer{};
    std::uint64_t offset{};
    std::vector<std::byte> bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("offer", self.offer, "of offer_update");
      field("offset", self.offset, "of the first byte in the bundle");
      field("bytes", self.bytes, "at most 4000");
    }
  };
  struct Answer {
    std::uint64_t received_bytes{};
    std::uint64_t stored_bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("received_bytes", self.received_bytes, "what the box holds from the beginning on: go on there");
      field("stored_bytes", self.stored_bytes, "how much of it survives a power cut");
    }
  };
};

// Ends the transfer: the box checks the SHA-256 and hands the bundle to its updater. What comes of it says
// update_status.
struct InstallUpdate {
  static constexpr Operation kOperation = Operation::install_update;
  struct Request {
    std::uint32_t offer{};
    bool although_not_newer{};
    static constexpr void fields(auto& self, auto&& field) {
      field("offer", self.offer, "of offer_update");
      field("although_not_newer", self.although_not_newer, "1: also when its version is not above the one that runs");
    }
  };
  struct Answer {
    std::uint64_t installation{};
    static constexpr void fields(auto& self, auto&& field) {
      field("installation", self.installation, "names this installation, also after the restart of the box");
    }
  };
};

// Tests whether nothing more comes of the installation that has this state.
constexpr bool isOver(UpdateState state) {
  return state == UpdateState::done || state == UpdateState::not_installed || state == UpdateState::gone_back;
}

// Reports how an update stands.
struct UpdateStatus {
  static constexpr Operation kOperation = Operation::update_status;
  using Request = Nothing;
  struct Answer {
    UpdateState state{};
    std::uint64_t installation{};
    std::string name{};
    std::string version{};
    std::uint64_t received_bytes{};
    std::uint64_t total_bytes{};
    std::uint8_t percent{};
    std::string running_version{};
    std::string text{};
    std::string why_not{};
    static constexpr void fields(auto& self, auto&& field) {
      field("state", self.state,
            "0 none, 1 receiving, 2 checking, 3 waiting for the updater, 4 installing, 5 installed and waiting for a "
            "restart, 6 restarting, 7 done: it runs, 8 not installed, 9 gone back to the version before");
      field("installation", self.installation, "that the state is about, as install_update named it; 0 for none");
      field("name", self.name, "of the bundle's file; empty when not known");
      field("version", self.version, "of the bundle; empty when not known");
      field("received_bytes", self.received_bytes, "of the bundle that is being received");
      field("total_bytes", self.total_bytes, "of that bundle; 0 for none");
      field("percent", self.percent, "of checking or installing");
      field("running_version", self.running_version, "of the image that runs; empty when not known");
      field("text", self.text, "what came of it, or what it waits for, for a person; may be empty");
      field("why_not", self.why_not, "why no update is possible now, for a person; empty when one is");
    }
  };
};

}  // namespace probebox::messages
