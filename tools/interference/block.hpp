#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/interference/motion.hpp"

namespace probebox::interference {

// The words of a block. Each is taken by the code that it belongs to; one that is left over is an error.
class Block {
 public:
  // text: as bare() returns it, without a slash.
  static Outcome<Block, Refusal> of(const std::string& text, std::size_t line);

  std::size_t line() const { return line_; }
  const std::vector<double>& g() const { return g_; }
  const std::vector<double>& m() const { return m_; }
  bool has(char letter) const { return find(letter) != nullptr; }
  // The value of a word that nobody has taken yet.
  std::optional<double> take(char letter);
  // The first word that nobody has taken, such as "P3".
  std::optional<std::string> leftOver() const;
  Refusal refusal(std::string name, std::string what) const { return {std::move(name), line_, std::move(what)}; }

 private:
  struct Word {
    char letter{};
    double value{};
    std::string text;
    bool taken{};
  };
  const Word* find(char letter) const;

  std::size_t line_{};
  std::vector<double> g_, m_;
  std::vector<Word> words_;
};

// A line without comments and blanks, in capitals. Siemens: its comments begin with a semicolon alone, and brackets
// are part of the text.
Outcome<std::string, Refusal> bare(std::string_view text, bool siemens, std::size_t line);

// Whether `text` is a line of a macro language, or begins with one of these words.
bool beginsWith(std::string_view text, std::initializer_list<std::string_view> words);

}  // namespace probebox::interference
