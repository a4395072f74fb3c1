#include "firmware/app/results/cutting_time.hpp"

#include <filesystem>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

class CuttingTimeOnDisk : public testing::Test {
 protected:
  CuttingTimeOnDisk() { std::filesystem::remove(path_); }

  static box::State at(double s, bool cutting) {
    box::State state;
    state.at = monoTime(static_cast<std::int64_t>(1e9 * s));
    state.snapshot.cutting = cutting;
    return state;
  }

  const std::string path_ = testing::TempDir() + "cutting";
};

TEST_F(CuttingTimeOnDisk, CountsWhileACutIsOn) {
  CuttingTime time{path_, store::Before::perhaps};
  for (const auto& [s, cuts] : {std::pair{10, false}, {11, true}, {14, true}, {20, false}, {30, false}, {31, true}})
    time.look(at(s, cuts));
  EXPECT_EQ(time.count().s, 5) << "from each state that cuts back to the one before";
}

TEST_F(CuttingTimeOnDisk, IsKeptWhenACutEndsAndWhileOneIsLong) {
  {
    CuttingTime time{path_, store::Before::perhaps};
    time.look(at(0, true));
    time.look(at(100, true));
    time.look(at(101, false));
  }  // killed
  {
    CuttingTime time{path_, store::Before::had_it};
    EXPECT_EQ(time.count().s, 100);
    time.look(at(0, true));
    time.look(at(CuttingTime::kKeptEvery_s + 5, true));
    time.look(at(CuttingTime::kKeptEvery_s + 50, true));
  }  // killed during the cut
  CuttingTime time{path_, store::Before::had_it};
  EXPECT_EQ(time.count().s, 100 + CuttingTime::kKeptEvery_s + 5);
  time.look(at(0, true));
  time.look(at(10, true));
  time.finish();
  EXPECT_EQ((CuttingTime{path_, store::Before::had_it}.count().s), 115 + CuttingTime::kKeptEvery_s);
  EXPECT_EQ(time.problem(), "");
}

TEST_F(CuttingTimeOnDisk, ShortCutsAreWrittenTogether) {
  const auto onDisk = [&] { return CuttingTime{path_, store::Before::had_it}.count().s; };
  CuttingTime time{path_, store::Before::perhaps};
  double s = 0;
  const auto cutFor = [&](double duration_s) {
    time.look(at(s, false));
    time.look(at(s += duration_s, true));
    time.look(at(s, false));
  };
  cutFor(CuttingTime::kKeptAfterCut_s - 1);
  EXPECT_EQ(onDisk(), 0);
  cutFor(2);
  EXPECT_EQ(onDisk(), CuttingTime::kKeptAfterCut_s + 1);
}

TEST_F(CuttingTimeOnDisk, IsAnotherCounterWhereItWasLost) {
  const auto first = CuttingTime{path_, store::Before::perhaps}.count();
  EXPECT_EQ((CuttingTime{path_, store::Before::had_it}.count().counter), first.counter);
  std::filesystem::remove(path_);
  const CuttingTime next{path_, store::Before::had_it};
  EXPECT_NE(next.count().counter, first.counter);
  EXPECT_NE(next.problem(), "");
}

}  // namespace
}  // namespace probebox::app
