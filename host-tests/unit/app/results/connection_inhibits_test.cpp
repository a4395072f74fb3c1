#include "firmware/app/results/connection_inhibits.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <sys/resource.h>
#include <thread>

#include "host-tests/support/in_child.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kLathe = "modbus:/dev/ttyS2";
constexpr const char* kRobot = "modbus:/dev/ttyS3";

class ConnectionInhibitsTest : public testing::Test {
 protected:
  ConnectionInhibitsTest() { reopen(); }
  void reopen() {
    book_.emplace(folder_.file("connections"), [this](bool inhibited) {
      told_.push_back(inhibited);
      return core_takes_;
    });
    told_.clear();
  }
  ConnectionInhibits& book() { return *book_; }

  support::TemporaryFolder folder_{support::inMemory()};
  std::vector<bool> told_;
  bool core_takes_{true};
  std::optional<ConnectionInhibits> book_;
};

TEST_F(ConnectionInhibitsTest, EachLineKeepsItsWordOrderOverARestart) {
  EXPECT_EQ(book().wordOrder(kLathe), 0);
  ASSERT_FALSE(book().keepWordOrder(kLathe, 1));
  EXPECT_EQ(book().wordOrder(kRobot), 0);
  reopen();
  EXPECT_EQ(book().wordOrder(kLathe), 1);
  EXPECT_EQ(book().wordOrder(kRobot), 0);
  ASSERT_FALSE(book().keepWordOrder(kLathe, 0));
  reopen();
  EXPECT_EQ(book().wordOrder(kLathe), 0);
}

TEST_F(ConnectionInhibitsTest, ACutIsOnWhileAnyConnectionSaysSoAndEachEndsItsOwnAlone) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  ASSERT_FALSE(book().setInhibit("person:Ada", true, "Ada"));
  ASSERT_FALSE(book().setInhibit(kRobot, false, "")) << "it holds none";
  EXPECT_THAT(book().holders(),
              ElementsAre(Field(&ConnectionEntry::connection, kLathe), Field(&ConnectionEntry::by, "Ada")));
  ASSERT_FALSE(book().setInhibit("person:Ada", false, "Ada"));
  EXPECT_TRUE(book().inhibits(kLathe));
  EXPECT_FALSE(book().inhibits("person:Ada"));
  EXPECT_TRUE(book().anyInhibits());
  ASSERT_FALSE(book().setInhibit(kLathe, false, ""));
  EXPECT_FALSE(book().anyInhibits());
  EXPECT_THAT(told_, ElementsAre(true, true, true, false));
}

TEST_F(ConnectionInhibitsTest, ACutOutlivesARestart) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  reopen();
  EXPECT_TRUE(book().inhibits(kLathe));
  EXPECT_FALSE(book().inhibits(kRobot));
  EXPECT_TRUE(book().anyInhibits());
}

TEST_F(ConnectionInhibitsTest, APersonClearsWhatAConnectionThatIsGoneHolds) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  const auto wrong = book().clearInhibit(kRobot, "Ada");
  ASSERT_TRUE(wrong);
  EXPECT_THAT(wrong->what, HasSubstr(kLathe)) << "it names who holds one";
  EXPECT_TRUE(book().anyInhibits());
  ASSERT_FALSE(book().clearInhibit(kLathe, "Ada"));
  EXPECT_FALSE(book().anyInhibits());
  reopen();
  EXPECT_FALSE(book().anyInhibits());
}

TEST_F(ConnectionInhibitsTest, HoldsUntilAPersonLooksWhereTheFileWasDamaged) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  book_.reset();
  std::ofstream{folder_.file("connections"), std::ios::trunc} << "garbage";
  reopen();
  EXPECT_TRUE(book().anyInhibits()) << "nobody knows whether a cut is on";
  EXPECT_THAT(book().problem(), HasSubstr("damaged"));
  const auto holders = book().holders();
  ASSERT_EQ(holders.size(), 1U);
  ASSERT_FALSE(book().clearInhibit(holders.front().connection, "Ada"));
  EXPECT_FALSE(book().anyInhibits());
}

TEST_F(ConnectionInhibitsTest, HoldsAfterALossThatWasFoundOnAFullDisk) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  book_.reset();
  std::ofstream{folder_.file("connections"), std::ios::trunc} << "garbage";
  EXPECT_TRUE(support::holdsInChild([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1, 1};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    reopen();
    return book().anyInhibits();
  }));
  reopen();
  EXPECT_TRUE(book().anyInhibits()) << "nobody has looked yet";
  reopen();
  EXPECT_TRUE(book().anyInhibits());
}

TEST_F(ConnectionInhibitsTest, ACutThatCannotBeStoredIsOnAllTheSameAndSaidSo) {
  support::TemporaryFolder gone;
  ConnectionInhibits unwritable{gone.file("no such folder/connections"), [this](bool inhibited) {
                                  told_.push_back(inhibited);
                                  return true;
                                }};
  EXPECT_THAT(unwritable.problem(), HasSubstr("connections"));
  for (int i = 0; i < 2; ++i) {
    const auto error = unwritable.setInhibit(kLathe, true, "");
    ASSERT_TRUE(error) << "nobody is told that it lasts";
    EXPECT_THAT(error->what, HasSubstr("box ends"));
    EXPECT_TRUE(unwritable.inhibits(kLathe));
  }
  EXPECT_TRUE(unwritable.setInhibit(kLathe, false, "")) << "an end that would be forgotten does not count";
  EXPECT_TRUE(unwritable.anyInhibits());
  EXPECT_TRUE(unwritable.keepWordOrder(kLathe, 1));
  EXPECT_EQ(unwritable.wordOrder(kLathe), 0);
  EXPECT_THAT(told_, ElementsAre(true, true));
}

TEST_F(ConnectionInhibitsTest, SaysSoWhenTheCoreTakesNothing) {
  core_takes_ = false;
  ASSERT_TRUE(book().setInhibit(kLathe, true, ""));
  EXPECT_TRUE(book().inhibits(kLathe)) << "it will be in force, with the next word at the latest";
}

TEST_F(ConnectionInhibitsTest, TellsTheCoreWhenItIsSaidAgain) {
  core_takes_ = false;
  ASSERT_TRUE(book().setInhibit(kLathe, true, ""));
  ASSERT_TRUE(book().setInhibit(kLathe, true, "")) << "the core has not heard of it";
  core_takes_ = true;
  told_.clear();
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  EXPECT_THAT(told_, ElementsAre(true));
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  EXPECT_THAT(told_, ElementsAre(true)) << "it has heard of it";
}

TEST_F(ConnectionInhibitsTest, TellsTheCoreThatACutIsOverWhenItIsSaidAgain) {
  for (const bool by_a_person : {false, true}) {
    const auto end = [&] {
      return by_a_person ? book().clearInhibit(kLathe, "Ada") : book().setInhibit(kLathe, false, "");
    };
    ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
    core_takes_ = false;
    ASSERT_TRUE(end());
    core_takes_ = true;
    told_.clear();
    ASSERT_FALSE(end()) << by_a_person;
    EXPECT_THAT(told_, ElementsAre(false)) << by_a_person;
  }
}

// Of this process and all its files.
void takeNothingOnDisks() {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit nothing{1, 1};
  ::setrlimit(RLIMIT_FSIZE, &nothing);
}

// Of two lines on a disk that takes nothing any more.
TEST_F(ConnectionInhibitsTest, RefusesTheLineWhoseInhibitIsNotOnTheDiskAndNoOther) {
  ASSERT_FALSE(book().setInhibit(kLathe, true, ""));
  book_.reset();
  EXPECT_TRUE(support::holdsInChild([this] {
    takeNothingOnDisks();
    reopen();
    for (int i = 0; i < 2; ++i) {
      if (book().setInhibit(kLathe, true, "") || !book().setInhibit(kRobot, true, "")) return false;
      if (book().setInhibit("person:Ada", false, "Ada")) return false;
    }
    if (!book().inhibits(kRobot) || !book().setInhibit(kLathe, false, "")) return false;
    return book().setInhibit(kLathe, true, "").has_value();  // nobody knows what the disk has of its end
  }));
}

TEST_F(ConnectionInhibitsTest, WritesTheWordOrderOfBeforeAgainWhenTheDiskMayHaveAnother) {
  ASSERT_FALSE(book().keepWordOrder(kLathe, 1));
  book_.reset();
  EXPECT_TRUE(support::holdsInChild([this] {
    takeNothingOnDisks();
    reopen();
    if (book().keepWordOrder(kLathe, 1) || !book().keepWordOrder(kLathe, 0)) return false;
    return book().wordOrder(kLathe) == 1 && book().keepWordOrder(kLathe, 1).has_value();
  }));
}

TEST_F(ConnectionInhibitsTest, DeclaresNoCutWhileAResultComesIntoForce) {
  auto cut_lock = book().tryLockOutCuts();
  ASSERT_TRUE(cut_lock);
  std::atomic<bool> acknowledged{};
  std::thread controller{[&] {
    EXPECT_FALSE(book().setInhibit(kLathe, true, ""));
    acknowledged = true;
  }};
  std::this_thread::sleep_for(std::chrono::milliseconds{20});
  EXPECT_FALSE(acknowledged);
  EXPECT_FALSE(book().anyInhibits());
  // However many results follow one another, the controller comes between.
  while (cut_lock) {
    cut_lock.reset();
    cut_lock = book().tryLockOutCuts();
  }
  controller.join();
  EXPECT_TRUE(book().inhibits(kLathe));
  EXPECT_FALSE(book().tryLockOutCuts());
  ASSERT_FALSE(book().setInhibit(kLathe, false, ""));
  EXPECT_TRUE(book().tryLockOutCuts());
}

TEST_F(ConnectionInhibitsTest, RefusesACutWhereAResultTakesTooLong) {
  auto cut_lock = book().tryLockOutCuts();
  std::optional<Error> refusal;
  std::thread{[&] { refusal = book().setInhibit(kLathe, true, ""); }}.join();
  ASSERT_TRUE(refusal);
  EXPECT_THAT(refusal->what, HasSubstr("again"));
  EXPECT_FALSE(book().anyInhibits());
  cut_lock.reset();
  EXPECT_TRUE(book().tryLockOutCuts()) << "the connection waits no more";
  EXPECT_FALSE(book().setInhibit(kLathe, true, ""));
}

TEST_F(ConnectionInhibitsTest, HasRoomForSoManyNamesAndSaysSo) {
  for (std::size_t i = 0; i < ConnectionInhibits::kMostConnections; ++i)
    ASSERT_FALSE(book().setInhibit(std::string(ConnectionInhibits::kMostName - 2, 'x') + std::to_string(10 + i), true,
                                   std::string(ConnectionInhibits::kMostName, 'y')));
  EXPECT_THAT(book().setInhibit("one more", true, "")->what, HasSubstr("already"));
  ASSERT_FALSE(book().setInhibit(std::string(ConnectionInhibits::kMostName - 2, 'x') + "10", false, ""));
  EXPECT_FALSE(book().setInhibit("one more", true, "")) << "what holds nothing gives way";
  EXPECT_THAT(book().setInhibit(std::string(ConnectionInhibits::kMostName + 1, 'z'), true, "")->what,
              HasSubstr("bytes"));
}

TEST_F(ConnectionInhibitsTest, KeepsPlacesForLinesHoweverManyNamesHold) {
  std::size_t persons = 0;
  while (persons < 100 && !book().setInhibit("person:job-" + std::to_string(persons), true, "job")) ++persons;
  EXPECT_EQ(persons, ConnectionInhibits::kMostPersons);
  EXPECT_THAT(book().setInhibit("person:one more", true, "")->what, HasSubstr("8 persons"));
  EXPECT_FALSE(book().setInhibit(kLathe, true, ""));
  EXPECT_FALSE(book().keepWordOrder(kRobot, 1));
  ASSERT_FALSE(book().setInhibit("person:job-3", false, "job"));
  EXPECT_FALSE(book().setInhibit("person:one more", true, "")) << "what holds nothing gives way";
  reopen();
  EXPECT_TRUE(book().inhibits(kLathe));
  EXPECT_TRUE(book().inhibits("person:one more"));
  EXPECT_EQ(book().wordOrder(kRobot), 1);
}

}  // namespace
}  // namespace probebox::app
