#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include PROBEBOX_ENTRY

// Inputs of a target that a fuzzer found worth keeping (tools/fuzz), each of which reaches something that the others do
// not. One line of hexadecimal digits an input.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytesOf(const std::string& digits) {
  Bytes bytes;
  for (std::size_t k = 0; k + 1 < digits.size(); k += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(k, 2), nullptr, 16)));
  return bytes;
}

TEST(Corpus, HoldsWhatTheEntryRequires) {
  std::ifstream file{PROBEBOX_CORPUS};
  std::size_t inputs = 0;
  for (std::string line; std::getline(file, line); ++inputs) {
    const auto bytes = bytesOf(line);
    ASSERT_EQ(PROBEBOX_FEED(bytes.data(), bytes.size()), 0) << inputs;
  }
  EXPECT_GT(inputs, 5U);
}

}  // namespace
}  // namespace probebox
