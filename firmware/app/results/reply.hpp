#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// The answer to a request, with the link and ticket that it goes to.
struct Reply {
  std::uint64_t link{};
  std::uint64_t ticket{};
  messages::ErrorCode code{};
  std::string text;
  std::vector<std::byte> body;
};

inline Reply refused(messages::ErrorCode code, std::string text) {
  return {.link = 0, .ticket = 0, .code = code, .text = std::move(text), .body = {}};
}

template <class Answer>
Reply ok(const Answer& answer) {
  return {.link = 0, .ticket = 0, .code = messages::ErrorCode::ok, .text = {}, .body = messages::encoded(answer)};
}

inline Reply malformed(messages::Operation operation) {
  return refused(messages::ErrorCode::malformed,
                 "The request " + std::string{messages::nameOf(operation)} +
                     " ends inside a field: check that it is encoded with this protocol version.");
}

// key: of service.toml.
inline Reply notPermitted(const char* key) {
  return refused(messages::ErrorCode::not_permitted,
                 std::string{"This operation is disabled for this link: set "} + key +
                     " = true in service.toml, in the [[connection]] of the link or, where it has none, in [access]; " +
                     "of a tls: link in the [[person]] whom the certificate names.");
}

}  // namespace probebox::app
