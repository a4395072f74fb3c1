#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fake_box.hpp"
#include "in_process.hpp"
#include "protocol/messages/control.hpp"

// `calibrate --temperature`, and boxes that do not know of it.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Finished onBox(const FakeBox& box, std::vector<std::string> words) {
  words.insert(words.begin(), {"-u", box.uri()});
  return probebox(words);
}

TEST(CalibratingAtATemperature, StatesTheTemperatureOfTheRun) {
  messages::StartProcedure::Request asked;
  FakeBoxOptions options;
  options.answers_first = [&](messages::Operation operation,
                              std::span<const std::byte> body) -> std::optional<FakeReply> {
    if (operation == messages::Operation::start_procedure)
      asked = messages::decode<messages::StartProcedure::Request>(body).value();
    return std::nullopt;
  };
  const FakeBox box{options};
  const auto done = onBox(box, {"calibrate", "delay-multi-speed", "--temperature", "23.4"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_TRUE(asked.options.has_temperature);
  EXPECT_EQ(asked.options.temperature_c, 23.4);
  EXPECT_EQ(onBox(box, {"calibrate", "delay-multi-speed"}).status, 0);
  EXPECT_FALSE(asked.options.has_temperature);
  for (const auto* wrong : {"296", "warm", "nan"}) {
    const auto refused = onBox(box, {"calibrate", "delay-multi-speed", "--temperature", wrong});
    EXPECT_EQ(refused.status, 2) << wrong;
    EXPECT_THAT(refused.err, HasSubstr("-30"));
  }
}

}  // namespace
}  // namespace probebox::command
