#include "firmware/app/results/last_served_file.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host-tests/support/in_child.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using Correction = std::array<double, kLinearAxes>;

class Served : public testing::Test {
 protected:
  Served() { ::unsetenv("RUNTIME_DIRECTORY"); }
  static published::Snapshot snapshotOf(const Correction& correction_mm, MonoTime at) {
    published::Snapshot snapshot;
    snapshot.correction_mm = correction_mm;
    snapshot.at = at;
    snapshot.valid = true;
    return snapshot;
  }
  std::string path() const { return folder_.file("served-last"); }

  support::TemporaryFolder folder_{support::inMemory()};
};

TEST_F(Served, IsKnownToTheLastDigitAfterAKill) {
  const auto child = ::fork();
  if (child == 0) {
    LastServedFile record{path()};
    for (int k = 0; k <= 1000; ++k) record.note(snapshotOf({k * 1e-6, -k * 1e-6, 0.123456}, MonoTime{k * 1ms}));
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto before = LastServedFile{path()}.before().found_mm;
  ASSERT_TRUE(before);
  EXPECT_DOUBLE_EQ((*before)[0], 0.001);
  EXPECT_DOUBLE_EQ((*before)[1], -0.001);
  EXPECT_DOUBLE_EQ((*before)[2], 0.123456);
}

TEST_F(Served, IsTheNewestOfAllThatAnyLineRead) {
  LastServedFile record{path()};
  EXPECT_FALSE(record.before().found_mm);
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{1s}));
  EXPECT_DOUBLE_EQ((*LastServedFile{path()}.before().found_mm)[0], 0.002);
}

TEST_F(Served, IsWhatAnEarlierProcessServedUntilThisOneServes) {
  EXPECT_FALSE(LastServedFile{path()}.last());
  LastServedFile{path()}.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  LastServedFile record{path()};
  EXPECT_DOUBLE_EQ(record.last()->newest_mm[0], 0.002);
  record.note(snapshotOf({0.003, 0, 0}, MonoTime{3s}));
  EXPECT_DOUBLE_EQ(record.last()->newest_mm[0], 0.003);
  EXPECT_DOUBLE_EQ((*record.before().found_mm)[0], 0.002);
}

// An orderly end writes it elsewhere.
TEST_F(Served, KnowsWhatWasReadThoughItsFileTakesNothing) {
  LastServedFile homeless{folder_.file("no such folder/served-last")};
  homeless.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  EXPECT_DOUBLE_EQ(homeless.last()->newest_mm[0], 0.002);

  LastServedFile record{path()};
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{1s}));
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit nothing{.rlim_cur = 0, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &nothing);
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_DOUBLE_EQ(record.last()->newest_mm[0], 0.002);
  EXPECT_FALSE(LastServedFile{path()}.before().found_mm) << "older than what was read last: not to be taken for it";
}

TEST_F(Served, HoldsNoValueThatNobodyFollows) {
  LastServedFile record{path()};
  auto in_doubt = snapshotOf({0.002, 0, 0}, MonoTime{1s});
  in_doubt.valid = false;
  record.note(in_doubt);
  EXPECT_FALSE(LastServedFile{path()}.before().found_mm);
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{2s}));
  in_doubt.at = MonoTime{3s};
  record.note(in_doubt);
  EXPECT_DOUBLE_EQ((*LastServedFile{path()}.before().found_mm)[0], 0.001);
}

TEST_F(Served, IsNotBelievedOfAnotherRunOfTheComputerOrWhenDamaged) {
  {
    LastServedFile record{path()};
    record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  }
  std::string sound;
  {
    std::ifstream in{path(), std::ios::binary};
    sound.assign(std::istreambuf_iterator<char>{in}, {});
  }
  for (std::size_t i = 0; i < sound.size(); ++i) {
    auto damaged = sound;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    std::ofstream{path(), std::ios::binary | std::ios::trunc} << damaged;
    EXPECT_FALSE(LastServedFile{path()}.before().found_mm) << "byte " << i;
  }
}

TEST_F(Served, IsWrittenAnewWhereItsFileWasRemoved) {
  LastServedFile record{path()};
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  std::filesystem::remove(path());
  record.note(snapshotOf({0.003, 0, 0}, MonoTime{3s}));
  const LastServedFile next{path()};
  ASSERT_TRUE(next.before().found_mm);
  EXPECT_DOUBLE_EQ((*next.before().found_mm)[0], 0.003);
  EXPECT_EQ(next.before().found_start, record.before().start);
  EXPECT_TRUE(next.before().is_kept);
}

TEST_F(Served, IsReadWhereItCannotBeWrittenAndSaysSo) {
  LastServedFile{path()}.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0755});
  std::filesystem::permissions(path(), std::filesystem::perms{0444});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    const LastServedFile next{path()};
    return next.before().found_mm && (*next.before().found_mm)[0] == 0.002 && !next.before().is_kept;
  }));
}

constexpr LastServedFile::Limits kTwentyUmPerS{{{0.5, 0.02}, {0.5, 0.02}, {0.5, 0.02}}};

// The box goes on to 0.1 mm while a line is unplugged.
TEST_F(Served, GoesOnFromWhatEachReaderReadLastAtTheLimitOfRate) {
  LastServedFile record{path(), kTwentyUmPerS};
  const auto read = [&](const char* reader, double wanted_mm, Nanoseconds at) {
    auto core = snapshotOf({wanted_mm, 0, 0}, MonoTime{at});
    core.settled = true;
    auto shown = record.shownTo(reader, core);
    record.note(shown, reader);
    return shown;
  };
  EXPECT_EQ(read("line", 0.01, 980ms).correction_mm[0], 0.01) << "the first value that it reads";
  EXPECT_EQ(read("line", 0.01, 1s).correction_mm[0], 0.01);
  for (auto at = 1s + 100ms; at < 5s; at += 100ms)
    read("monitor", 0.01 + 2e-5 * static_cast<double>(at / 1ms - 1000), at);
  double before_mm = 0.01;
  std::uint16_t sequence = 0;
  auto at = 5s + 0ms;
  for (bool is_first = true; before_mm < 0.09; at += 20ms, is_first = false) {
    ASSERT_LT(at, 12s);
    const auto shown = read("line", 0.09, at);
    const double most_mm = 0.02 * (is_first ? 2 * 0.02 + 0.05 : 0.02);
    EXPECT_LE(shown.correction_mm[0] - before_mm, most_mm + 1e-9);
    EXPECT_GT(shown.correction_mm[0], before_mm);
    EXPECT_EQ(shown.settled, shown.correction_mm[0] == 0.09);
    EXPECT_NE(shown.sequence, sequence) << "each value is a new one";
    before_mm = shown.correction_mm[0];
    sequence = shown.sequence;
  }
  EXPECT_EQ(read("line", 0.09, at).sequence, sequence) << "and the same one is not";
  EXPECT_EQ(read("monitor", 0.09, at).correction_mm[0], 0.09) << "it never stopped reading";
}

TEST_F(Served, KeepsWhereEachReaderStandsOverAKill) {
  {
    LastServedFile record{path(), kTwentyUmPerS};
    record.note(snapshotOf({0.01, 0, 0}, MonoTime{1s}), "line");
    record.note(snapshotOf({0.09, 0, 0}, MonoTime{5s}), "monitor");
    EXPECT_DOUBLE_EQ(record.last()->least_mm[0], 0.01);
    EXPECT_DOUBLE_EQ(record.last()->greatest_mm[0], 0.09);
  }
  LastServedFile next{path(), kTwentyUmPerS};
  EXPECT_DOUBLE_EQ((*next.before().found_mm)[0], 0.09);
  next.setOnDisk(1, 0, LastServedFile::Correction{0.09, 0, 0});
  const auto shown = [&](const char* reader) {
    return next.shownTo(reader, snapshotOf({0.12, 0, 0}, MonoTime{20s})).correction_mm[0];
  };
  EXPECT_NEAR(shown("line"), 0.0114, 1e-9);
  EXPECT_NEAR(shown("monitor"), 0.0914, 1e-9);
  EXPECT_NEAR(shown("another"), 0.0914, 1e-9) << "it stands where the box takes the axes to stand";
}

TEST_F(Served, NumbersItsRecordsOverAllStarts) {
  std::uint64_t count = 0;
  for (int start = 0; start < 3; ++start) {
    LastServedFile record{path()};
    EXPECT_EQ(record.before().found_count, count);
    for (int k = 0; k < 5; ++k) record.note(snapshotOf({k * 0.001, 0, 0}, MonoTime{k * 1s}));
    EXPECT_GT(record.last()->count, count);
    count = record.last()->count;
  }
}

TEST_F(Served, WithoutAFolderNothingIsKnownAndNothingFalls) {
  LastServedFile record{folder_.file("no such folder/served-last")};
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  EXPECT_FALSE(record.before().found_mm);
}

}  // namespace
}  // namespace probebox::app
