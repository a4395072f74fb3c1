#pragma once
#include <gtest/gtest.h>
#include <string>
#include <string_view>

#include "board/describe/parse.hpp"

namespace probebox::board {

template <class T>
std::string problemOf(const Outcome<T>& outcome) {
  EXPECT_FALSE(outcome.ok());
  return outcome.ok() ? "" : outcome.error().what;
}
inline std::string problemOfBox(const std::string& text) {
  SCOPED_TRACE(text);
  return problemOf(parseBox(text, "box.toml"));
}

// One text of a description exchanged for another.
inline std::string exchanged(std::string text, std::string_view from, std::string_view to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace probebox::board
