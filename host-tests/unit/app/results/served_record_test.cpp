#include "firmware/app/results/served_record.hpp"

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
    ServedRecord record{path()};
    for (int k = 0; k <= 1000; ++k) record.note(snapshotOf({k * 1e-6, -k * 1e-6, 0.123456}, MonoTime{k * 1ms}));
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto before = ServedRecord{path()}.before().found_mm;
  ASSERT_TRUE(before);
  EXPECT_DOUBLE_EQ((*before)[0], 0.001);
  EXPECT_DOUBLE_EQ((*before)[1], -0.001);
  EXPECT_DOUBLE_EQ((*before)[2], 0.123456);
}

TEST_F(Served, IsTheNewestOfAllThatAnyLineRead) {
  ServedRecord record{path()};
  EXPECT_FALSE(record.before().found_mm);
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{1s}));
  EXPECT_DOUBLE_EQ((*ServedRecord{path()}.before().found_mm)[0], 0.002);
}

TEST_F(Served, IsWhatAnEarlierProcessServedUntilThisOneServes) {
  EXPECT_FALSE(ServedRecord{path()}.last());
  ServedRecord{path()}.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  ServedRecord record{path()};
  EXPECT_DOUBLE_EQ((*record.last())[0], 0.002);
  record.note(snapshotOf({0.003, 0, 0}, MonoTime{3s}));
  EXPECT_DOUBLE_EQ((*record.last())[0], 0.003);
  EXPECT_DOUBLE_EQ((*record.before().found_mm)[0], 0.002);
}

// An orderly end writes it elsewhere.
TEST_F(Served, KnowsWhatWasReadThoughItsFileTakesNothing) {
  ServedRecord homeless{folder_.file("no such folder/served-last")};
  homeless.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  EXPECT_DOUBLE_EQ((*homeless.last())[0], 0.002);

  ServedRecord record{path()};
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{1s}));
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit nothing{.rlim_cur = 0, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &nothing);
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_DOUBLE_EQ((*record.last())[0], 0.002);
  EXPECT_FALSE(ServedRecord{path()}.before().found_mm) << "older than what was read last: not to be taken for it";
}

TEST_F(Served, HoldsNoValueThatNobodyFollows) {
  ServedRecord record{path()};
  auto in_doubt = snapshotOf({0.002, 0, 0}, MonoTime{1s});
  in_doubt.valid = false;
  record.note(in_doubt);
  EXPECT_FALSE(ServedRecord{path()}.before().found_mm);
  record.note(snapshotOf({0.001, 0, 0}, MonoTime{2s}));
  in_doubt.at = MonoTime{3s};
  record.note(in_doubt);
  EXPECT_DOUBLE_EQ((*ServedRecord{path()}.before().found_mm)[0], 0.001);
}

TEST_F(Served, IsNotBelievedOfAnotherRunOfTheComputerOrWhenDamaged) {
  {
    ServedRecord record{path()};
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
    EXPECT_FALSE(ServedRecord{path()}.before().found_mm) << "byte " << i;
  }
}

TEST_F(Served, IsWrittenAnewWhereItsFileWasRemoved) {
  ServedRecord record{path()};
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  std::filesystem::remove(path());
  record.note(snapshotOf({0.003, 0, 0}, MonoTime{3s}));
  const ServedRecord next{path()};
  ASSERT_TRUE(next.before().found_mm);
  EXPECT_DOUBLE_EQ((*next.before().found_mm)[0], 0.003);
  EXPECT_EQ(next.before().found_start, record.before().start);
  EXPECT_TRUE(next.before().is_kept);
}

TEST_F(Served, IsReadWhereItCannotBeWrittenAndSaysSo) {
  ServedRecord{path()}.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0755});
  std::filesystem::permissions(path(), std::filesystem::perms{0444});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    const ServedRecord next{path()};
    return next.before().found_mm && (*next.before().found_mm)[0] == 0.002 && !next.before().is_kept;
  }));
}

TEST_F(Served, WithoutAFolderNothingIsKnownAndNothingFalls) {
  ServedRecord record{folder_.file("no such folder/served-last")};
  record.note(snapshotOf({0.002, 0, 0}, MonoTime{2s}));
  EXPECT_FALSE(record.before().found_mm);
}

}  // namespace
}  // namespace probebox::app
