#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/address.hpp"
#include "drivers/world/box_link.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Connects the emulated controller to its box over TCP and the public control channel, like any other host. Never
// waits; the next question reopens a lost connection.
class ControllerLink : public world::BoxLink {
 public:
  // has_y: false on a lathe of X and Z, which homes the two.
  explicit ControllerLink(tcp::Address box, bool has_y = true);
  ~ControllerLink() override;

  void postMarker(const Marker& marker) override;
  void home(const world::Vector3& position_mm) override;
  std::optional<bool> markerAnswer() override;
  void askProcedureStatus() override;
  std::optional<world::Prompt> procedureStatus() override;

 private:
  bool connected();
  std::uint32_t ask(messages::Operation operation, std::vector<std::byte> body);
  void sendRequest(std::uint32_t id, messages::Operation operation, std::vector<std::byte> body);
  void send(messages::MessageType type, const std::vector<std::byte>& payload);
  void transmit();
  void receive();
  void take(const messages::AnswerView& answer);

  tcp::Address box_;
  bool has_y_;
  std::unique_ptr<io::BytePipe> pipe_;
  frame::Reader reader_;
  std::vector<std::byte> outgoing_;
  std::uint32_t sequence_{};
  std::uint32_t last_id_{};
  std::uint32_t marker_id_{};
  std::vector<std::byte> marker_body_;
  MonoTime marker_at_{};
  std::uint32_t status_id_{};
  std::optional<bool> marker_answer_;
  std::optional<world::Prompt> status_;
};

}  // namespace probebox::app
