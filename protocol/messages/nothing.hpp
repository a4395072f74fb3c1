#pragma once

#include "protocol/messages/fields.hpp"

// Declares the empty payload that many operations share.
namespace probebox::messages {

// The payload of requests and answers without fields.
struct Nothing {
  static constexpr void fields(auto&, auto&&) {}
};

}  // namespace probebox::messages
