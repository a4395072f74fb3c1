#include "doomed_disk.hpp"

#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/store/store.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/sanitized.hpp"
#include "scratch.hpp"

// The store on a disk that fails at every single call, one after the other.
namespace probebox::store {
namespace {

constexpr const char* kPath = "results.db";

// One thing that is asked of the store; true when it acknowledged.
using Step = std::function<bool(Store&)>;

bool propose(Store& store, double tau_s) {
  return store.propose(kBinding, delayOf(tau_s), std::string(3000, 'x'), "t0").ok();
}

// A case about two subjects.
bool proposeTwo(Store& store) {
  const Binding other{"stylus-offset-1", kBinding.probe_serial_number, kBinding.machine, kBinding.mounting};
  const std::vector<Proposal> both{{kBinding, delayOf(7e-3), {}}, {other, delayOf(8e-3), {.rests_on = {3}}}};
  return store.propose(both, std::string(3000, 'y'), "t8").ok();
}

// Ids 1 and 2 are in the file that every script begins with.
const std::vector<Step>& script() {
  static const std::vector<Step> steps{
      [](Store& s) { return propose(s, 3e-3); },                         // 3
      [](Store& s) { return decided::accept(s, 3, "Ada", "t1").ok(); },  // 2 is retired
      [](Store& s) {
        return s.refuse(kBinding, "m", {"a", "b"}, "d", "t3").ok();
      },                                                                            // 4
      [](Store& s) { return propose(s, 5e-3); },                                    // 5
      [](Store& s) { return decided::accept(s, 5, "Ada", "t4", true).ok(); },       //
      [](Store& s) { return decided::activate(s, 5, "t5").ok(); },                  // 3 is retired
      [](Store& s) { return decided::rollBack(s, kBinding, "Grace", "t6").ok(); },  // 3 is back
      [](Store& s) { return proposeTwo(s); },                                       // 6 and 7, or neither
  };
  return steps;
}

// All that the store holds, as text.
std::string told(Store& store) {
  std::string all;
  for (Id id = 1; id < 10; ++id) {
    const auto record = store.find(id);
    if (!record) continue;
    all += std::to_string(id) + " " + std::string{name(record->state)} + " " + record->accepted_by + " " +
           record->accepted_utc + " " + record->retired_utc + " " + std::to_string(store.dataset(id).value().size()) +
           "\n";
    const auto history = store.history(id).value();
    for (const auto& t : history) all += "  " + std::string{name(t.to)} + " " + t.utc + " " + t.by + "\n";
  }
  return all;
}

class StoreOnADoomedDisk : public testing::Test {
 protected:
  // The file, then what the store holds after each number of steps on a disk that works.
  void prepare(DoomedDisk& disk) {
    {
      auto store = Store::open(kPath).value();
      for (const double tau_s : {1e-3, 2e-3}) {  // the first is retired
        const auto id = store.propose(kBinding, delayOf(tau_s), "measured", "t0");
        ASSERT_TRUE(id && decided::accept(store, *id, "Ada", "t0"));
      }
    }
    disk.powerOn(DoomedDisk::Unsynced::written);
    start_ = disk.image();
    {
      auto store = Store::open(kPath).value();
      truth_ = {told(store)};
      for (const auto& step : script()) {
        ASSERT_TRUE(step(store));
        truth_.push_back(told(store));
      }
    }
    changes_ = disk.changes();
    calls_ = disk.calls();
    disk.setImage(start_);
    disk.repair();
  }

  // Runs until the first step that is not acknowledged. The number of those that were.
  static std::size_t runUntilFailure() {
    auto store = Store::open(kPath);
    if (!store) return 0;
    std::size_t done = 0;
    while (done < script().size() && script()[done](*store)) ++done;
    return done;
  }

  // What was acknowledged is there; what was under way has happened or not, and nothing else has.
  void expectWhole(std::size_t acknowledged, const std::string& when) {
    auto store = Store::open(kPath);
    ASSERT_TRUE(store) << when << store.error().what;
    ASSERT_EQ(store->notice(), "") << when;
    const auto now = told(*store);
    const bool as_acknowledged = now == truth_[acknowledged];
    const bool one_more = acknowledged + 1 < truth_.size() && now == truth_[acknowledged + 1];
    ASSERT_TRUE(as_acknowledged || one_more) << when << "after " << acknowledged << " steps:\n" << now;
    EXPECT_TRUE(store->propose(kBinding, delayOf(1), "", "t9")) << when;
  }

  void cutAtEveryChange(DoomedDisk::Promises promises) {
    const std::uint64_t torn = runsAreComplete() ? 3 : 1;
    DoomedDisk disk{promises};
    prepare(disk);
    for (std::size_t n = 0; n < changes_ && !HasFatalFailure(); ++n) {
      disk.setImage(start_);
      disk.repair();
      disk.cutPowerAt(n);
      const auto acknowledged = runUntilFailure();
      const auto left = disk.image();
      const auto after = [&](DoomedDisk::Unsynced fate, std::uint64_t seed) {
        disk.setImage(left);
        disk.powerOn(fate, seed);
        expectWhole(acknowledged, "cut at change " + std::to_string(n) + ", fate " +
                                      std::to_string(static_cast<int>(fate)) + "." + std::to_string(seed) + ": ");
      };
      after(DoomedDisk::Unsynced::lost, 0);
      after(DoomedDisk::Unsynced::written, 0);
      for (std::uint64_t seed = 0; seed < torn; ++seed) after(DoomedDisk::Unsynced::torn, n * 100 + seed);
    }
  }

  DoomedDisk::Image start_;
  std::vector<std::string> truth_;
  std::size_t changes_{}, calls_{};
};

TEST_F(StoreOnADoomedDisk, SurvivesACutOfThePowerAtEveryChange) {
  cutAtEveryChange({.sector_bytes = 4096, .keeps_neighbours = true});
  EXPECT_GT(changes_, 100U) << "too few to prove anything";
}

TEST_F(StoreOnADoomedDisk, SurvivesACutOnADiskOfSmallSectorsThatPromisesNothing) {
  cutAtEveryChange({.sector_bytes = 512, .keeps_neighbours = false});
}

// Every step says what is wrong while the disk is full or broken, changes nothing then, and works afterwards.
void worksAgain(DoomedDisk& disk, const std::vector<std::string>& truth, std::size_t start, Store& store,
                const std::string& when) {
  disk.repair();
  ASSERT_EQ(told(store), truth[start]) << when;
  for (std::size_t done = start; done < script().size(); ++done) ASSERT_TRUE(script()[done](store)) << when << done;
  ASSERT_EQ(told(store), truth.back()) << when;
}

TEST_F(StoreOnADoomedDisk, LosesNothingOnAFullDiskAndWorksAgainWhenThereIsSpace) {
  DoomedDisk disk;
  prepare(disk);
  for (std::size_t n = 0; n < changes_ && !HasFatalFailure(); ++n) {
    const auto when = "full at change " + std::to_string(n) + ": ";
    disk.setImage(start_);
    disk.repair();
    disk.fillUpAt(n);
    auto store = Store::open(kPath);
    if (!store) {
      EXPECT_EQ(store.error().reason, Reason::unavailable) << when << store.error().what;
      EXPECT_THAT(store.error().what, testing::HasSubstr("full")) << when;
      disk.repair();
      store = Store::open(kPath);
      ASSERT_TRUE(store) << when << store.error().what;
      ASSERT_EQ(told(*store), truth_[0]) << when;
      continue;
    }
    std::size_t done = 0;
    while (done < script().size() && script()[done](*store)) ++done;
    if (done == script().size()) continue;
    const auto refused = store->propose(kBinding, delayOf(1), std::string(3000, 'x'), "t");
    ASSERT_FALSE(refused) << when;
    EXPECT_THAT(refused.error().what, testing::HasSubstr("disk is full")) << when;
    worksAgain(disk, truth_, done, *store, when);
  }
}

TEST_F(StoreOnADoomedDisk, LosesNothingWhenAnyCallFailsOnceOrForGood) {
  DoomedDisk disk;
  prepare(disk);
  std::size_t refused_openings = 0;
  for (const bool for_good : {false, true}) {
    // A disk that is gone for good does the same from call to call: one of seven will do. The sanitizers have no more.
    const std::size_t step = for_good || support::kSanitized ? 7 : runsAreComplete() ? 1 : 3;
    for (std::size_t n = 0; n < calls_ && !HasFatalFailure(); n += step) {
      const auto when =
          std::string{for_good ? "fails for good" : "fails once"} + " at call " + std::to_string(n) + ": ";
      disk.setImage(start_);
      disk.repair();
      disk.failAt(n, for_good);
      auto store = Store::open(kPath);
      if (!store) {
        ++refused_openings;
        EXPECT_EQ(store.error().reason, Reason::unavailable) << when << store.error().what;
        EXPECT_THAT(store.error().what, testing::HasSubstr(kPath)) << when;
        disk.repair();
        store = Store::open(kPath);
        ASSERT_TRUE(store) << when << store.error().what;
        ASSERT_EQ(told(*store), truth_[0]) << when;
        continue;
      }
      ASSERT_EQ(store->notice(), "") << when << "a sound file was taken for a damaged one";
      std::size_t done = 0;
      while (done < script().size() && script()[done](*store)) ++done;
      if (done < script().size()) worksAgain(disk, truth_, done, *store, when);
    }
  }
  EXPECT_GT(refused_openings, support::kSanitized || !runsAreComplete() ? 2U : 10U);
}

}  // namespace
}  // namespace probebox::store
