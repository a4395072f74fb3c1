#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "board/describe/sim_files.hpp"
#include "board/describe/start_files.hpp"
#include "description_entry.hpp"

// The fuzzer's entry without a fuzzer: the descriptions of the emulated board with every slip in every line, the same
// every time. Each is accepted for a reason, or refused with the line and a sentence.
namespace probebox {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::array kNames{"box.toml", "machine.toml", "probe.toml", "service.toml", "world.toml", "unit.toml"};

// A line "key = value   # why", or one that is something else.
struct Line {
  std::string text;
  std::string key, value;  // empty for other lines
};

Line lineOf(const std::string& text) {
  const auto equals = text.find(" = ");
  const bool is_key = equals != std::string::npos && text[0] >= 'a' && text[0] <= 'z' && text.find(' ') == equals;
  if (!is_key) return {text, "", ""};
  auto value = text.substr(equals + 3);
  if (const auto comment = value.find("  #"); comment != std::string::npos) value.erase(comment);
  value.erase(value.find_last_not_of(' ') + 1);
  return {text, text.substr(0, equals), value};
}

// The emulated board has no identity of its own.
std::string shippedFile(const std::string& file) {
  return std::string{file == "unit.toml" ? board::startFile(file) : board::simFile(file)};
}

std::vector<Line> linesOf(const char* file) {
  std::vector<Line> lines;
  const auto text = shippedFile(file);
  for (std::size_t at = 0; at < text.size();) {
    const auto end = text.find('\n', at);
    lines.push_back(lineOf(text.substr(at, end - at)));
    at = end + 1;
  }
  return lines;
}

// The file with line `k` exchanged for another, or left out.
std::string with(const std::vector<Line>& lines, std::size_t k, const std::optional<std::string>& replacement) {
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i != k) {
      text += lines[i].text + "\n";
    } else if (replacement) {
      text += *replacement + "\n";
    }
  }
  return text;
}

bool isOneNumber(const std::string& value) {
  return value.find_first_not_of("+-0123456789._xe") == std::string::npos;
}
bool isWhole(const std::string& value) {
  return value.front() == '[' ? value.back() == ']' : true;  // not the first line of an array
}

// Every key of every file with `replacement(line)` for its value.
template <class Replacement, class Expect>
void forEveryKey(Replacement replacement, Expect expect) {
  for (const auto* const file : kNames) {
    const auto lines = linesOf(file);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      if (lines[k].key.empty() || !isWhole(lines[k].value)) continue;
      const auto value = replacement(lines[k]);
      if (!value) continue;
      const auto text = lines[k].key + " = " + *value;
      SCOPED_TRACE(std::string{file} + ":" + std::to_string(k + 1) + ": " + text.substr(0, 100));
      expect(problemsOf(file, with(lines, k, text)), std::string{file} + ":" + std::to_string(k + 1) + ": ");
    }
  }
}

constexpr auto kRefused = [](const std::string& problems, const std::string& place) {
  EXPECT_THAT(problems, HasSubstr(place));
};

TEST(DescriptionFuzz, ShippedDescriptionsAreAccepted) {
  for (const auto* const file : kNames) EXPECT_THAT(problemsOf(file, shippedFile(file)), IsEmpty());
}

TEST(DescriptionFuzz, NoNumberIsBeyondWhatItsUnitCanBe) {
  const auto numbers = [](const char* value) {
    return [value](const Line& line) {
      return isOneNumber(line.value) ? std::optional{std::string{value}} : std::nullopt;
    };
  };
  for (const char* const value : {"1e308", "-1e308", "1152921504606846976", "-1152921504606846977", "9007199254740993",
                                  "nan", "-nan", "inf", "-inf", "9223372036854775807"})
    forEveryKey(numbers(value), kRefused);
}

TEST(DescriptionFuzz, NoVectorHasAnElementBeyondWhatItsUnitCanBe) {
  for (const char* const value : {"1e308", "1152921504606846976", "nan", "true", "\"1\"", "[1, 2, 3]", "{a = 1}"}) {
    forEveryKey(
        [value](const Line& line) -> std::optional<std::string> {
          if (line.value.front() != '[' || line.value.find('"') != std::string::npos || line.value == "[]")
            return std::nullopt;
          return std::string{"["} + value + line.value.substr(line.value.find(','));
        },
        kRefused);
  }
}

TEST(DescriptionFuzz, NoTextIsEmptyLongOrUnprintable) {
  const auto texts = [](const std::string& value) {
    return [value](const Line& line) { return line.value.front() == '"' ? std::optional{value} : std::nullopt; };
  };
  for (const char* const value : {"\"\"", "\"   \"", "\"a\\nb\"", "\"a\\u001b[2Jb\"", "\"a\\u0085b\"", "\"\\u202Eba\"",
                                  "\"a\\u200Bb\"", "\"a\\u0000\"", "\"\"\"a\nb\"\"\""})
    forEveryKey(texts(value), kRefused);
  forEveryKey(texts("\"" + std::string(20'000, 'a') + "\""), kRefused);
  forEveryKey(texts("\"" + std::string(20'000, '.') + "\""), kRefused);
}

TEST(DescriptionFuzz, NoKeyTakesAValueOfAnotherType) {
  const auto typed = [](const std::string& value, auto differs) {
    return [=](const Line& line) { return differs(line.value.front()) ? std::optional{value} : std::nullopt; };
  };
  // A line of a chip may be a name or an offset.
  forEveryKey(
      [](const Line& line) {
        const bool takes_a_text = line.value.front() == '"' || line.key == "line";
        return takes_a_text ? std::nullopt : std::optional{std::string{"\"x y z\""}};
      },
      kRefused);
  forEveryKey(typed("true", [](char c) { return c != 't' && c != 'f'; }), kRefused);
  forEveryKey(
      [](const Line& line) {
        return line.key == "line" || line.value.front() != '"' ? std::nullopt : std::optional{std::string{"5"}};
      },
      kRefused);
  forEveryKey(typed("{}", [](char c) { return c != '{'; }), kRefused);
  forEveryKey(typed("2025-01-01", [](char) { return true; }), kRefused);
  forEveryKey(typed("[[[1]]]", [](char) { return true; }), kRefused);
  forEveryKey(typed("[" + std::string(2'000, '[') + std::string(2'000, ']') + "]", [](char) { return true; }),
              kRefused);
}

// Zero and -1 mean something for some keys. All that matters is that the answer is one or the other.
TEST(DescriptionFuzz, EveryOtherSlipIsAcceptedOrRefusedWithItsLine) {
  std::size_t accepted = 0, refused = 0;
  const auto count = [&](const std::string& problems) { ++(problems.empty() ? accepted : refused); };
  for (const auto* const file : kNames) {
    const auto lines = linesOf(file);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      SCOPED_TRACE(std::string{file} + ":" + std::to_string(k + 1) + ": " + lines[k].text);
      count(problemsOf(file, with(lines, k, std::nullopt)));
      const auto twice = problemsOf(file, with(lines, k, lines[k].text + "\n" + lines[k].text));
      if (lines[k].key.empty()) continue;
      EXPECT_THAT(twice, Not(IsEmpty())) << "a key that is there twice";
      for (const char* const value : {"0", "-1", "[]", "", "[", "\"", "= 1", "0x", "1e"})
        count(problemsOf(file, with(lines, k, lines[k].key + " = " + value)));
      for (const std::string& key : {lines[k].key + "x", lines[k].key.substr(1), std::string{"\"\\u001b\\n\""},
                                     lines[k].key + ".a", std::string(20'000, 'k')})
        EXPECT_THAT(problemsOf(file, with(lines, k, key + " = " + lines[k].value)), Not(IsEmpty())) << key;
    }
  }
  EXPECT_GT(accepted, 250U) << "comments, and keys that may be left out";
  EXPECT_GT(refused, 2000U);
}

TEST(DescriptionFuzz, TextsThatAreMadeToBreakTheParserAreRefused) {
  std::string deep = "a";
  for (int k = 0; k < 40'000; ++k) deep += ".a";
  std::string nested;
  for (int k = 0; k < 250; ++k) nested += "a = [\n{";
  std::string wide;
  for (int k = 0; k < 9'000; ++k) wide += "[[tool]]\n";
  std::string header;
  for (int k = 0; k < 12'000; ++k) header += "[a" + std::to_string(k) + "]\n";
  for (const auto& text : {deep + " = 1\n", "[" + deep + "]\n", "x = { " + deep + " = 1 }\n", nested, wide, header,
                           std::string(99'000, '['), std::string(99'000, '{'), std::string(99'000, '"'),
                           std::string(200'000, '#'), std::string("a = 1\0b", 7), std::string("\xef\xbb\xbf\xff", 4)})
    for (const auto* const file : kNames) EXPECT_THAT(problemsOf(file, text), Not(IsEmpty())) << text.substr(0, 40);
}

TEST(DescriptionFuzz, DamagedBytesAreAcceptedOrRefusedWithTheirLine) {
  std::mt19937_64 random{20261122};
  EXPECT_EQ(feedDescription(nullptr, 0), 0);
  for (int round = 0; round < 3000; ++round) {
    const auto which = random() % kNames.size();
    const std::string text = shippedFile(kNames.at(which));
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(which)};
    bytes.insert(bytes.end(), text.begin(), text.end());
    for (auto times = 1 + random() % 8; times > 0 && bytes.size() > 2; --times) {
      const auto at = static_cast<std::ptrdiff_t>(1 + random() % (bytes.size() - 1));
      switch (random() % 4) {
        case 0:
          bytes.erase(bytes.begin() + at);
          break;
        case 1:
          bytes.insert(bytes.begin() + at, static_cast<std::uint8_t>("0123456789.-[]{}=\"\n# e"[random() % 22]));
          break;
        case 2:
          bytes.at(static_cast<std::size_t>(at)) = static_cast<std::uint8_t>(random());
          break;
        default:
          bytes.resize(static_cast<std::size_t>(at) + 1);
      }
    }
    EXPECT_EQ(feedDescription(bytes.data(), bytes.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
