#include "chain.hpp"

#include <gtest/gtest.h>

// 100 kS/s from events to a host's samples over a real connection: values, not times. `bench_stream` has the times.
namespace probebox::chain {
namespace {

using namespace std::chrono_literals;

class FromEventToHost : public testing::TestWithParam<messages::Profile> {};

TEST_P(FromEventToHost, EverySampleArrivesAsItWasEncoded) {
  Chain chain{GetParam()};
  chain.addUp(true);
  chain.run(scanEvents(3s));
  chain.finish();
  EXPECT_TRUE(chain.exact());
  EXPECT_NEAR(static_cast<double>(chain.account().received), 2.9e5, 1e4);
  EXPECT_EQ(chain.account().declared_lost, 0U);
  EXPECT_EQ(chain.account().inferred_lost, 0U);
  EXPECT_EQ(chain.decodedSum(), chain.encodedSum());
  EXPECT_NE(chain.decodedSum(), 0U);
}

TEST_P(FromEventToHost, WhatTheProbeOwesIsDeclared) {
  Chain chain{GetParam()};
  chain.addUp(true);
  chain.run(scanEvents(3s, 20ms));
  chain.finish();
  EXPECT_TRUE(chain.exact());
  EXPECT_NEAR(static_cast<double>(chain.account().declared_lost), 3 * 2000, 30);
  EXPECT_EQ(chain.account().declared_lost, chain.box().snapshot.ledger.lost_at_source);
  EXPECT_EQ(chain.decodedSum(), chain.encodedSum());
}

INSTANTIATE_TEST_SUITE_P(Profiles, FromEventToHost, testing::Values(messages::Profile::raw, messages::Profile::fast),
                         [](const auto& of_one) { return std::string{messages::nameOf(of_one.param)}; });

}  // namespace
}  // namespace probebox::chain
