#pragma once
#include <cstddef>
#include <string>

// What a page of the terminal is made of.
namespace probebox::command {

enum class Style { plain, soft, strong, good, warned, bad, bar };

// Text on the screen. It is cut at the right edge.
struct Span {
  std::size_t row{};
  std::size_t column{};
  std::string text;
  Style style{Style::plain};
};

struct ScreenSize {
  std::size_t rows{};
  std::size_t columns{};
  // The page needs 24 rows of 80 columns.
  bool fits() const { return rows >= 24 && columns >= 80; }
};

}  // namespace probebox::command
