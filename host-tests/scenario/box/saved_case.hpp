#pragma once
#include <cstddef>
#include <gtest/gtest.h>

#include "firmware/metrology/solve.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::scenario {

// A saved case has every digit of the run.
inline void expectTheSameFrom(const metrology::Dataset& dataset, const metrology::Result& result) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(casefolder::writeCase(dataset, folder.path() / "case"));
  const auto read = casefolder::readCase(folder.path() / "case");
  ASSERT_TRUE(read);
  const auto again = metrology::solve(*read);
  ASSERT_TRUE(again);
  ASSERT_EQ(again->estimates.size(), result.estimates.size());
  for (std::size_t i = 0; i < result.estimates.size(); ++i) {
    EXPECT_EQ(again->estimates[i].values, result.estimates[i].values) << result.estimates[i].key;
    EXPECT_EQ(again->estimates[i].sd, result.estimates[i].sd) << result.estimates[i].key;
  }
}

}  // namespace probebox::scenario
