#pragma once

#include "protocol/messages/fields.hpp"

// What many operations ask or answer.
namespace probebox::messages {

// For requests and answers that say nothing.
struct Nothing {
  static constexpr void fields(auto&, auto&&) {}
};

}  // namespace probebox::messages
