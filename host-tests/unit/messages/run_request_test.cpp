#include "protocol/messages/run_request.hpp"

#include <gtest/gtest.h>
#include <span>

// What a host asks of a run, as options of the run.
namespace probebox::messages {
namespace {

TEST(TemperatureOfARun, TravelsWithItsRequestAndIsNoneFromAnOlderHost) {
  ProcedureOptions options;
  options.has_temperature = true;
  options.temperature_c = 23.4;
  const auto bytes = encoded(requestOf("centreline", options));
  const auto request = decode<StartProcedure::Request>(bytes);
  ASSERT_TRUE(request);
  const auto back = optionsOf(*request);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->has_temperature);
  EXPECT_EQ(back->temperature_c, 23.4);
  // Its last two fields are a byte and eight.
  const auto older = decode<StartProcedure::Request>(std::span{bytes}.first(bytes.size() - 9));
  ASSERT_TRUE(older);
  EXPECT_FALSE(optionsOf(*older)->has_temperature);
}

}  // namespace
}  // namespace probebox::messages
