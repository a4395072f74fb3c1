#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"

// The control channel's envelope; control.hpp has what travels inside.
namespace probebox::messages {

// Requests an operation, host to box. Repeated with the same id until answered; the box executes it once.
template <class BytesType>
struct BasicRequest {
  static constexpr MessageType kType = MessageType::request;
  std::uint32_t id{};
  Operation operation{};
  BytesType body{};
  static constexpr void fields(auto& self, auto&& field) {
    field("id", self.id, "chosen by the host, rising, never used twice between two HELLOs");
    field("operation", self.operation, "what to do");
    field("body", self.body, "the operation's request structure");
  }
};
using Request = BasicRequest<std::vector<std::byte>>;
using RequestView = BasicRequest<std::span<const std::byte>>;

// Answers a REQUEST, box to host.
template <class TextType, class BytesType>
struct BasicAnswer {
  static constexpr MessageType kType = MessageType::answer;
  std::uint32_t id{};
  Operation operation{};
  ErrorCode code{};
  TextType text{};
  BytesType body{};
  static constexpr void fields(auto& self, auto&& field) {
    field("id", self.id, "of the request");
    field("operation", self.operation, "of the request");
    field("code", self.code, "0 ok, otherwise a named error");
    field("text", self.text, "empty when ok; otherwise what went wrong and what to do, for a person");
    field("body", self.body, "the operation's answer structure; empty on an error");
  }
};
using Answer = BasicAnswer<std::string, std::vector<std::byte>>;
using AnswerView = BasicAnswer<std::string_view, std::span<const std::byte>>;

}  // namespace probebox::messages
