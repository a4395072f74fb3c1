#include "firmware/app/results/applied_correction_file.hpp"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <utility>

#include "host-tests/support/in_child.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;
using Correction = AppliedCorrectionFile::Correction;

constexpr AppliedCorrectionFile::Limits kLimits{{{0.5, 0.05}, {0.5, 0.02}, {0.5, 0}}};
constexpr MonoTime kStart{1000s};

class Standing : public testing::Test {
 protected:
  AppliedCorrectionFile keeper() {
    return {folder_.file("served"), kLimits,
            [this](const Event& event) { told_.push_back(std::get<ServableWithin>(event)); }};
  }
  struct Restored {
    AppliedRestored standing;
    ServableWithin within;
  };
  // exactly: as the start before has recorded it.
  Restored restored(AppliedCorrectionFile& keeper, const std::optional<Correction>& exactly = std::nullopt) {
    ++start_;
    return restored(keeper, {.start = start_, .is_kept = true, .found_start = start_ - 1, .found_mm = exactly});
  }
  static Restored restored(AppliedCorrectionFile& keeper, const LastServedAtStart& served) {
    const auto events = keeper.restore(kStart, served);
    return {std::get<AppliedRestored>(events.at(0)), std::get<ServableWithin>(events.at(1))};
  }
  Restored afterAnEnd(const std::optional<Correction>& exactly = std::nullopt) {
    auto next = keeper();
    return restored(next, exactly);
  }
  static published::Snapshot serving(const Correction& correction_mm, Nanoseconds later, bool valid = true) {
    published::Snapshot snapshot;
    snapshot.valid = valid;
    snapshot.correction_mm = correction_mm;
    snapshot.at = kStart + later;
    return snapshot;
  }

  support::TemporaryFolder folder_{support::inMemory()};
  std::vector<ServableWithin> told_;
  std::uint64_t start_{};
};

TEST_F(Standing, BeginsAtZeroWithoutADoubtWhereNothingWasEverServed) {
  auto first = keeper();
  const auto [standing, within] = restored(first);
  EXPECT_EQ(standing.correction_mm, Correction{});
  EXPECT_EQ(standing.doubt_mm, Correction{});
  EXPECT_EQ(within.greatest_mm, (Correction{0.05, 0.02, 0})) << "as far as it goes in a second";
  EXPECT_EQ(within.least_mm, (Correction{-0.05, -0.02, 0}));
}

// The core serves what its bounds allow, and no end leaves the axes beyond what the disk knows then.
TEST_F(Standing, IsKnownOnTheDiskToWithinWhatMayBeServed) {
  auto box = keeper();
  auto bounds = restored(box).within;
  double x_mm = 0;
  for (int k = 1; k <= 200; ++k) {
    // A ramp that goes as far as it may within each 20 ms, there and back.
    const double step = k <= 120 ? 0.001 : -0.001;
    x_mm = std::clamp(x_mm + step, bounds.least_mm[0], bounds.greatest_mm[0]);
    const auto after = afterAnEnd();
    ASSERT_LE(std::abs(x_mm - after.standing.correction_mm[0]), after.standing.doubt_mm[0] + 1e-12) << k;
    box.look(serving({x_mm, 0, 0}, k * 20ms));
    if (!told_.empty()) bounds = told_.back();
  }
  EXPECT_GT(told_.size(), 4U);
}

TEST_F(Standing, KeepsUpWithARampAtItsLimitOfRate) {
  auto box = keeper();
  restored(box);
  for (int k = 1; k <= 40; ++k) box.look(serving({0.005 * k, 0, 0}, k * 100ms));  // 0.05 mm/s
  EXPECT_GT(told_.back().greatest_mm[0], 0.2 + 0.02) << "there is room for what comes next";
}

TEST_F(Standing, IsNotWrittenForEveryTrifle) {
  auto box = keeper();
  restored(box);
  box.look(serving({0.001, 0, 0}, 1s));
  const auto told = told_.size();
  box.look(serving({0.00105, 0, 0}, 10s));
  box.look(serving({0.003, 0, 0}, 1100ms));
  EXPECT_EQ(told_.size(), told) << "a change of 50 nm; a small one within the same second";
  box.look(serving({0.003, 0, 0}, 3s));
  EXPECT_GT(told_.size(), told);
  EXPECT_EQ(afterAnEnd().standing.correction_mm[0], 0.003);
}

TEST_F(Standing, IsExactAfterAKillAndAfterAProperEnd) {
  auto box = keeper();
  restored(box);
  box.look(serving({0.004, 0, 0}, 1s));
  const auto killed = afterAnEnd(Correction{0.0045, 0.001, 0});
  EXPECT_EQ(killed.standing.correction_mm, (Correction{0.0045, 0.001, 0}));
  EXPECT_EQ(killed.standing.doubt_mm, Correction{});
  box.look(serving({0.005, 0.001, 0}, 1100ms));
  box.finish(serving({0.005, 0.001, 0}, 1200ms));
  const auto ended = afterAnEnd();
  EXPECT_EQ(ended.standing.correction_mm, (Correction{0.005, 0.001, 0}));
  EXPECT_EQ(ended.standing.doubt_mm, Correction{});
  EXPECT_GT(ended.within.greatest_mm[0], 0.05) << "and it may go on from there";
}

// Of a start before the last one, in another folder or on a disk that took nothing meanwhile.
TEST_F(Standing, IsNotWhatAnOlderRecordSays) {
  {
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving({0.004, 0, 0}, 1s));
  }
  auto next = keeper();
  restored(next, {.start = 2, .is_kept = true});
  const Correction read_mm{0.02, 0, 0};
  next.look(serving(read_mm, 1s), LastRead{read_mm, read_mm, read_mm, 1});
  auto after = keeper();
  const auto [standing, within] =
      restored(after, {.start = 3, .is_kept = true, .found_start = 1, .found_mm = Correction{0.004, 0, 0}});
  EXPECT_EQ(standing.correction_mm[0], 0.02);
  EXPECT_EQ(standing.doubt_mm[0], 0.05);
}

// The correction goes on while no CNC reads it, and no axis follows.
TEST_F(Standing, IsWhatWasReadLastHoweverFarTheCorrectionWentSince) {
  auto box = keeper();
  restored(box);
  const Correction read_mm{0.0701, 0, 0};
  box.look(serving({0.3, 0, 0}, 1s), LastRead{read_mm, read_mm, read_mm, 7});
  auto next = keeper();
  const auto after =
      restored(next, {.start = 2, .is_kept = true, .found_start = 1, .found_count = 7, .found_mm = read_mm});
  EXPECT_EQ(after.standing.correction_mm[0], 0.0701);
  EXPECT_EQ(after.standing.doubt_mm, Correction{});
}

// The record is lost with the power: the axes stand where they read last, and the disk knows it.
TEST_F(Standing, IsWhereItWasReadLastAlsoAfterAPowerCut) {
  auto box = keeper();
  restored(box);
  const Correction read_mm{0.0701, 0, 0}, other_mm{-0.02, 0, 0};
  box.look(serving({0.3, 0, 0}, 1s), LastRead{read_mm, other_mm, read_mm, 7});
  const auto after = afterAnEnd();
  EXPECT_EQ(after.standing.correction_mm[0], 0.0701);
  EXPECT_GE(after.standing.doubt_mm[0], 0.3 - 0.0701);
  EXPECT_LE(after.within.least_mm[0], -0.02) << "another reader stands there";
}

// A line that stays unplugged over two power cuts: the box went on twice, and no axis did.
TEST_F(Standing, IsWhereItWasWhileNobodyReads) {
  auto box = keeper();
  restored(box, {.start = 1, .is_kept = true});
  const Correction read_mm{0.01, 0, 0};
  box.look(serving(read_mm, 1s), LastRead{read_mm, read_mm, read_mm, 5});
  for (const std::uint64_t start : {2U, 3U}) {
    auto next = keeper();
    const auto found = restored(next, {.start = start, .is_kept = true});
    EXPECT_EQ(found.standing.correction_mm[0], 0.01) << start;
    EXPECT_GE(found.standing.doubt_mm[0], 0.05) << start;
    next.look(serving({0.2, 0, 0}, 1s));
  }
}

// A copy of the record that was put back, of the same start of the box and of the computer.
TEST_F(Standing, IsNotWhatARecordSaysThatTheDiskOutlives) {
  const Correction read_mm{0.01, 0, 0}, near_mm{0.005, 0, 0}, far_mm{-0.152, 0, 0};
  for (const auto& [count, found_mm] : {std::pair{29U, near_mm}, {29U, far_mm}, {31U, far_mm}}) {
    std::filesystem::remove(folder_.file("served"));
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving(read_mm, 1s), LastRead{read_mm, read_mm, read_mm, 30});
    auto next = keeper();
    const auto found =
        restored(next, {.start = 1, .is_kept = true, .found_start = 1, .found_count = count, .found_mm = found_mm});
    EXPECT_EQ(found.standing.correction_mm[0], 0.01);
    EXPECT_GE(found.standing.doubt_mm[0], 0.05) << "its age is not known";
    if (found_mm != far_mm) continue;
    EXPECT_LE(found.within.least_mm[0], far_mm[0]) << "the axes may stand there";
  }
}

// Killed before a CNC has read anything: its record is still that of the start before.
TEST_F(Standing, IsWhatWasReadBeforeTheLastStartWhereNobodyReadSince) {
  auto box = keeper();
  restored(box, {.start = 1, .is_kept = true});
  box.look(serving({0.004, 0, 0}, 1s));
  const Correction last_mm{0.0045, 0, 0};
  for (const std::uint64_t start : {2U, 3U, 4U}) {
    auto next = keeper();
    const auto found = restored(next, {.start = start, .is_kept = true, .found_start = 1, .found_mm = last_mm});
    EXPECT_EQ(found.standing.correction_mm, last_mm);
    EXPECT_EQ(found.standing.doubt_mm, Correction{});
  }
}

// The disk takes nothing, and the record lies in memory: it is newer than what the disk has.
TEST_F(Standing, IsWhatARecordSaysWhoseStartCouldNotWriteToTheDisk) {
  {
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving({0.004, 0, 0}, 1s));
    EXPECT_EQ(box.startOnDisk(), 1U);
  }
  const Correction last_mm{0.0045, 0, 0};
  auto next = keeper();
  const auto found =
      restored(next, {.start = 3, .is_kept = true, .found_start = 2, .found_on_disk = 1, .found_mm = last_mm});
  EXPECT_EQ(found.standing.correction_mm, last_mm);
  EXPECT_EQ(found.standing.doubt_mm, Correction{});
  EXPECT_EQ(next.startOnDisk(), 3U);
}

// Neither file takes anything: what the next start will believe is all that may be served.
TEST_F(Standing, StaysWhereARecordSaysThatCannotBeReplaced) {
  {
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving({0.004, 0, 0}, 1s));
  }
  const Correction last_mm{0.0045, 0, 0};
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0555});
  std::filesystem::permissions(folder_.file("served"), std::filesystem::perms{0444});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    auto box = keeper();
    const auto [standing, within] =
        restored(box, {.start = 2, .is_kept = false, .found_start = 1, .found_mm = last_mm});
    return standing.correction_mm == last_mm && within.least_mm == last_mm && within.greatest_mm == last_mm;
  }));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms{0755});
}

TEST_F(Standing, MayBeAnywhereWhereTheFileOfAnEarlierStartIsGone) {
  AppliedCorrectionFile box{folder_.file("served"), kLimits, [](const Event&) {}, store::Before::had_it};
  const auto found =
      restored(box, LastServedAtStart{.start = 2, .is_kept = true, .found_start = 1, .found_mm = Correction{}});
  EXPECT_EQ(found.standing.doubt_mm, (Correction{0.5, 0.5, 0.5}));
  EXPECT_THAT(box.notice(), HasSubstr("is gone"));
}

// As where a copy of `served` alone is put back: what a CNC has read last is of a later start, and lies elsewhere.
TEST_F(Standing, MayBeAtEitherWhereTheRecordContradictsTheDisk) {
  {
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving({0.004, 0, 0}, 1s));
  }
  auto box = keeper();
  const Correction last_mm{-0.094, 0, 0};
  const auto found =
      restored(box, {.start = 8, .is_kept = true, .found_start = 7, .found_on_disk = 6, .found_mm = last_mm});
  EXPECT_FALSE(found.standing.doubt_mm == Correction{});
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    EXPECT_GE(found.standing.correction_mm[axis] + found.standing.doubt_mm[axis], 0.004 * (axis == 0));
    EXPECT_LE(found.standing.correction_mm[axis] - found.standing.doubt_mm[axis], last_mm[axis]);
  }
  EXPECT_LE(found.within.least_mm[0], last_mm[0]);
  EXPECT_THAT(box.notice(), HasSubstr("served-last"));
  auto after = keeper();
  EXPECT_LE(restored(after, {.start = 9, .is_kept = true}).within.least_mm[0], last_mm[0]) << "after the next end too";
}

TEST_F(Standing, IsNotDoubtedForAnOldRecordWithinWhatTheDiskSays) {
  {
    auto box = keeper();
    restored(box, {.start = 1, .is_kept = true});
    box.look(serving({0.004, 0, 0}, 1s));
  }
  auto box = keeper();
  const auto found = restored(
      box, {.start = 8, .is_kept = true, .found_start = 7, .found_on_disk = 6, .found_mm = Correction{0.005, 0, 0}});
  EXPECT_EQ(found.standing.doubt_mm, (Correction{0.05, 0.02, 0}));
  EXPECT_THAT(box.notice(), IsEmpty());
}

TEST_F(Standing, WhatIsNotValidMovesNobody) {
  auto box = keeper();
  restored(box);
  box.look(serving({0.004, 0, 0}, 1s));
  auto next = keeper();
  restored(next);
  next.look(serving({0.3, 0, 0}, 2s, false));
  next.finish(serving({0.3, 0, 0}, 3s, false));
  EXPECT_EQ(afterAnEnd().standing.correction_mm[0], 0.004);
}

TEST_F(Standing, MayBeAnywhereWhereTheFileWasDamaged) {
  {
    auto box = keeper();
    restored(box);
    box.look(serving({0.004, 0, 0}, 1s));
  }
  std::ofstream{folder_.file("served"), std::ios::trunc} << "garbage";
  EXPECT_EQ(afterAnEnd().standing.doubt_mm[0], 0.5) << "all that the machine's limits allow";
  EXPECT_EQ(afterAnEnd().standing.doubt_mm[0], 0.5) << "after the next end too";
}

// As where a port is taken.
TEST_F(Standing, MayBeAnywhereAfterAStartThatFoundTheDamageAndFailed) {
  {
    auto box = keeper();
    restored(box);
    box.look(serving({0.03, 0, 0}, 1s));
  }
  std::ofstream{folder_.file("served"), std::ios::trunc} << "garbage";
  keeper();
  const auto after = afterAnEnd();
  EXPECT_EQ(after.standing.doubt_mm, (Correction{0.5, 0.5, 0.5}));
  EXPECT_EQ(after.within.greatest_mm[0], 0.5);
}

TEST_F(Standing, StaysWhereItIsOnADiskThatTakesNothing) {
  AppliedCorrectionFile box{folder_.file("no such folder/served"), kLimits,
                            [this](const Event& event) { told_.push_back(std::get<ServableWithin>(event)); }};
  const auto within = restored(box).within;
  EXPECT_EQ(within.greatest_mm, Correction{});
  EXPECT_THAT(box.problem(), HasSubstr("served"));
  box.look(serving({0, 0, 0}, 1s));
  for (const auto& bounds : told_) EXPECT_EQ(bounds.greatest_mm, Correction{});
}

}  // namespace
}  // namespace probebox::app
