#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/store/database.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/file_content.hpp"
#include "host-tests/support/in_child.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "scratch.hpp"

// What the disk turns into something else is never believed, and takes nothing else along.
namespace probebox::store {
namespace {

using support::contentOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Binding about(const std::string& subject) {
  return {subject, "P-1001", "mill 3", "spindle"};
}

void put(const std::string& path, const std::string& content) {
  std::ofstream{path, std::ios::binary | std::ios::trunc} << content;
}

const std::vector<std::string> kSubjects{"delay", "centreline", "screw-x", "tool-4"};

class Damage : public testing::Test {
 protected:
  // Three generations of each subject, the newest in force, and one that is only proposed.
  void fill() {
    auto store = Store::open(scratch_.file()).value();
    for (int generation = 1; generation <= 3; ++generation) {
      for (const auto& subject : kSubjects) {
        const auto id = store.propose(about(subject), delayOf(5.1998e-3 * generation), std::string(500, 'x'), "t0");
        ASSERT_TRUE(id);
        ASSERT_TRUE(decided::accept(store, *id, "Ada", "t1"));
        if (generation == 3) in_force_[subject] = *id;
      }
    }
    ASSERT_TRUE(store.propose(about("delay"), delayOf(0.25), "", "t2"));
  }
  std::string sql(const char* statement) const {
    sqlite3* handle = nullptr;
    sqlite3_open(scratch_.file().c_str(), &handle);
    char* error = nullptr;
    sqlite3_exec(handle, statement, nullptr, nullptr, &error);
    std::string text = error == nullptr ? "" : error;
    sqlite3_free(error);
    sqlite3_close(handle);
    return text;
  }
  Store reopened() const { return Store::open(scratch_.file()).value(); }

  Scratch scratch_;
  std::map<std::string, Id> in_force_;
};

TEST_F(Damage, OfARowInForceTakesItAloneOutOfForceAndNamesIt) {
  fill();
  const auto id = in_force_["delay"];
  ASSERT_EQ(sql(("UPDATE results SET result_json = replace(result_json, '0.0155994', '0.0115994') WHERE id = " +
                 std::to_string(id))
                    .c_str()),
            "");
  auto store = reopened();
  EXPECT_FALSE(decided::active(store, about("delay"))->has_value());
  EXPECT_EQ(decided::inState(store, State::active)->size(), kSubjects.size() - 1) << "the others are in force";
  EXPECT_THAT(store.damage(), ElementsAre(HasSubstr("result " + std::to_string(id) + " about delay is damaged")));
  EXPECT_EQ(store.find(id).error().reason, Reason::damaged);
  EXPECT_THAT(*decided::newest(store, 100), Not(Contains(testing::Field(&Record::id, id))));

  // New ones come into force, and then nobody has to be told any more.
  const auto fresh = store.propose(about("delay"), delayOf(1e-3), "", "t3");
  ASSERT_TRUE(fresh && decided::accept(store, *fresh, "Ada", "t4"));
  EXPECT_EQ((*decided::active(store, about("delay")))->id, *fresh);
  EXPECT_THAT(store.damage(), IsEmpty());
}

TEST_F(Damage, OfARowInForceLetsAPersonGoBack) {
  fill();
  ASSERT_EQ(sql("UPDATE results SET accepted_by = 'Eve' WHERE subject = 'delay' AND state = 2"), "");
  auto store = reopened();
  const auto back = decided::rollBack(store, about("delay"), "Ada", "t3");
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(back->active->id, in_force_["delay"] - kSubjects.size()) << "the one before";
}

TEST_F(Damage, WhileTheBoxRunsIsNoticedWhenTheRowIsAskedFor) {
  fill();
  auto store = reopened();
  const auto delay = store.propose(about("delay"), delayOf(1e-3), "", "t3").value();
  ASSERT_EQ(sql("UPDATE results SET state = 3 WHERE subject = 'tool-4' AND state = 2"), "");
  ASSERT_EQ(sql("UPDATE results SET method = 'delay-plates' WHERE subject = 'delay' AND state = 2"), "");
  EXPECT_EQ(decided::inState(store, State::active)->size(), 2U);
  EXPECT_EQ(store.damage().size(), 2U);
  EXPECT_TRUE(decided::accept(store, delay, "Ada", "t4"));
}

TEST_F(Damage, OfTheHistoryIsNotShown) {
  fill();
  ASSERT_EQ(sql("UPDATE transitions SET by_whom = 'Eve' WHERE id = 5"), "");
  auto store = reopened();
  const auto history = store.history(HistoryRange{});
  ASSERT_TRUE(history);
  for (const auto& transition : *history) EXPECT_NE(transition.by, "Eve");
  EXPECT_THAT(store.damage(), ElementsAre(HasSubstr("history")));
}

TEST_F(Damage, OfADatasetIsSaid) {
  fill();
  ASSERT_EQ(sql("UPDATE datasets SET json = replace(json, 'xxx', 'xyx') WHERE result_id = 1"), "");
  auto store = reopened();
  EXPECT_EQ(store.dataset(1).error().reason, Reason::damaged);
  EXPECT_EQ(store.dataset(2)->size(), 500U);
}

TEST_F(Damage, ARowThatHasGoneIsNamed) {
  fill();
  ASSERT_EQ(sql("PRAGMA foreign_keys = OFF; DELETE FROM results WHERE id IN (10, 13)"), "");
  auto store = reopened();
  EXPECT_THAT(store.damage(), ElementsAre(HasSubstr("10, 13")));
}

TEST_F(Damage, ASchemaNumberThatItsTablesBelieCostsNothing) {
  fill();
  for (const char* number : {"PRAGMA user_version = 0", "PRAGMA user_version = 4", "PRAGMA user_version = 69",
                             "PRAGMA application_id = 7"}) {
    ASSERT_EQ(sql(number), "");
    auto store = reopened();
    EXPECT_THAT(store.notice(), HasSubstr("13 results")) << number;
    EXPECT_THAT(store.damage(), IsEmpty());
    for (const auto& [subject, id] : in_force_) EXPECT_EQ((*decided::active(store, about(subject)))->id, id);
  }
}

TEST_F(Damage, OfTheHeaderIsNotTakenForAFileWithoutTheRightToWrite) {
  fill();
  auto content = contentOf(scratch_.file());
  content[18] = static_cast<char>(content[18] ^ 0x10);  // the write version
  put(scratch_.file(), content);
  auto store = reopened();
  EXPECT_THAT(store.notice(), HasSubstr("13 results"));
  for (const auto& [subject, id] : in_force_) EXPECT_EQ((*decided::active(store, about(subject)))->id, id);
  EXPECT_TRUE(store.propose(about("delay"), delayOf(1e-3), "", "t3"));
}

// Any bit of the file, one at a time: a result that is in force is the one that was, to the last digit; one that is not
// any more is named; and the store takes new ones.
TEST_F(Damage, OfAnyOneBitNeverPutsAnotherNumberIntoForceInSilence) {
  const auto trials = static_cast<int>(runs(3000));
  fill();
  const auto sound = contentOf(scratch_.file());
  std::map<std::string, metrology::Result> truth;
  {
    auto store = reopened();
    for (const auto& subject : kSubjects) truth[subject] = *(*decided::active(store, about(subject)))->result();
  }
  const support::TemporaryFolder folder{support::inMemory()};
  std::mt19937_64 random{20261122};
  int harmless = 0, worst = 0, took_several = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto file = folder.file("results-" + std::to_string(trial) + ".db");
    auto damaged = sound;
    const auto bit = random() % (8 * sound.size());
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    put(file, damaged);
    const auto when = "bit " + std::to_string(bit % 8) + " of byte " + std::to_string(bit / 8);
    auto store = Store::openAnyhow(file);
    ASSERT_THAT(store.whyNotWritable(), IsEmpty()) << when << ": " << store.notice();
    int lost = 0;
    for (const auto& subject : kSubjects) {
      const auto active = decided::active(store, about(subject));
      ASSERT_TRUE(active) << when << active.error().what;
      if (!*active) {
        ++lost;
        continue;
      }
      ASSERT_EQ((*active)->id, in_force_[subject]) << when;
      ASSERT_EQ(*(*active)->result(), truth[subject]) << when;
      ASSERT_EQ((*active)->accepted_by, "Ada") << when;
    }
    if (lost > 0) {
      ASSERT_FALSE(store.damage().empty() && store.notice().empty()) << when << ": in silence";
    }
    worst = std::max(worst, lost);
    if (lost > 1) ++took_several;
    if (lost == 0) ++harmless;
    const auto fresh = store.propose(about("delay"), delayOf(1e-3), "", "t3");
    ASSERT_TRUE(fresh) << when << fresh.error().what;
    ASSERT_TRUE(decided::accept(store, *fresh, "Ada", "t4")) << when;
    for (const auto& entry : std::filesystem::directory_iterator{folder.path()}) std::filesystem::remove(entry);
  }
  EXPECT_LT(took_several, trials / 25) << "a bit takes one result with it, seldom a page or the table of contents";
  EXPECT_GT(harmless, trials / 2);
  RecordProperty("harmless", harmless);
  RecordProperty("worst", worst);
  RecordProperty("took_several", took_several);
}

// As many as a cell that measures 300 tools a day has in four months.
TEST_F(Damage, TakesNoneOfManyChanges) {
  constexpr const char* kMany =
      "WITH RECURSIVE n(id) AS (SELECT 1000 UNION ALL SELECT id + 1 FROM n WHERE id < 101000) "
      "INSERT INTO transitions (id, result_id, state, utc, by_whom, checksum) "
      "SELECT id, 1, 3, '2026-01-01T00:00:00Z', 'Ada', row_sum(id, 1, 3, '2026-01-01T00:00:00Z', 'Ada') FROM n";
  fill();
  Id before = 0, last = 0;
  {
    ASSERT_TRUE(Database::open(scratch_.file()).value().run(kMany));
    auto store = reopened();
    for (auto* const id : {&before, &last}) {
      *id = store.propose(about("setter"), delayOf(0.5), "", "t3").value();
      ASSERT_TRUE(decided::accept(store, *id, "Ada", "t4"));
    }
  }
  auto content = contentOf(scratch_.file());
  content[18] = static_cast<char>(content[18] ^ 0x10);  // the header's write version
  put(scratch_.file(), content);
  auto store = reopened();
  EXPECT_THAT(store.notice(), HasSubstr("whole"));
  EXPECT_THAT(store.damage(), IsEmpty());
  const auto back = decided::rollBack(store, about("setter"), "Ada", "t5");
  ASSERT_TRUE(back) << back.error().what;
  ASSERT_TRUE(back->active);
  EXPECT_EQ(back->active->id, before);
}

// Read from either end, rows end at the first page that is unreadable; those between two such pages are asked for.
TEST_F(Damage, OfTwoPagesLeavesTheRowsBetweenThem) {
  constexpr std::size_t kPage = 4096;
  constexpr int kRows = 80;
  const auto value = [](int row) { return 0.1234567 + 1e-3 * row; };
  {
    auto store = Store::open(scratch_.file()).value();
    for (int row = 0; row < kRows; ++row) {
      ASSERT_TRUE(store.propose(about("tool-" + std::to_string(row)), delayOf(value(row)), "", "t0"));
    }
  }
  auto content = contentOf(scratch_.file());
  const auto pageOf = [&, sound = content](int row) {
    std::array<char, 32> digits{};
    std::snprintf(digits.data(), digits.size(), "%.7f", value(row));
    return sound.find(digits.data()) / kPage;
  };
  const std::size_t first = pageOf(kRows / 4), second = pageOf(3 * kRows / 4);
  for (const auto page : {first, second}) std::fill_n(content.begin() + static_cast<long>(page * kPage), kPage, '\xff');
  put(scratch_.file(), content);

  auto store = reopened();
  int lost = 0;
  for (int row = 0; row < kRows; ++row) {
    const bool is_gone = pageOf(row) == first || pageOf(row) == second;
    const auto found = store.find(static_cast<Id>(row + 1));
    ASSERT_EQ(found.ok(), !is_gone) << "row " << row + 1;
    if (found.ok()) {
      EXPECT_EQ(*found->result(), delayOf(value(row)));
    }
    lost += is_gone;
  }
  EXPECT_LT(lost, kRows / 4);
  EXPECT_LT(pageOf(kRows / 4) + 2, pageOf(3 * kRows / 4)) << "pages lie between";
}

// A child may have rights of its own without harm to the other tests.
template <class Check>
bool holdsAsNobody(Check check) {
  const auto child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) ::_exit(2);
    ::_exit(check() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST_F(Damage, AStoreThatCannotBeWrittenIsReadAndRefusesTheRestWithTheReason) {
  namespace fs = std::filesystem;
  fill();
  fs::permissions(scratch_.file(), fs::perms{0444});
  fs::permissions(scratch_.directory(), fs::perms{0555});
  EXPECT_TRUE(holdsAsNobody([&] {
    auto store = Store::openAnyhow(scratch_.file());
    const auto all = decided::inState(store, State::active);
    const auto accepted = decided::accept(store, 13, "Ada", "t3");
    const auto proposed = store.propose(about("delay"), delayOf(1), "", "t3");
    return all && all->size() == kSubjects.size() && !accepted && !proposed &&
           accepted.error().reason == Reason::unavailable &&
           accepted.error().what.find("nothing can be stored") != std::string::npos &&
           accepted.error().what.find("read-only") != std::string::npos && !store.notice().empty();
  }));
  fs::permissions(scratch_.directory(), fs::perms{0755});
}

TEST_F(Damage, AStoreThatIsNowhereStillAnswers) {
  auto store = Store::openAnyhow((scratch_.directory() / "absent" / "results.db").string());
  EXPECT_THAT(store.whyNotWritable(), HasSubstr("absent/results.db"));
  EXPECT_THAT(*decided::newest(store, 10), IsEmpty());
  EXPECT_EQ(store.propose(kBinding, delayOf(1), "", "t0").error().reason, Reason::unavailable);
}

TEST_F(Damage, AFolderOrALinkToNowhereInThePlaceOfTheStoreHasNothingToRead) {
  namespace fs = std::filesystem;
  const std::array<std::function<void()>, 2> kinds{
      [&] { fs::create_directory(scratch_.file()); },
      [&] { fs::create_symlink(scratch_.directory() / "absent" / "results.db", scratch_.file()); }};
  for (const auto& make : kinds) {
    make();
    const auto store = Store::openAnyhow(scratch_.file());
    EXPECT_THAT(store.whyNotWritable(), Not(IsEmpty()));
    EXPECT_THAT(store.notice(), HasSubstr("Nothing"));
    EXPECT_THAT(store.notice(), Not(HasSubstr("What it has can be read")));
    fs::remove(scratch_.file());
  }
}

// The limit on a file's size stands for a full disk.
TEST_F(Damage, ThatCannotBeMendedForWantOfRoomLeavesTheFileAndServesItsRows) {
  fill();
  auto damaged = contentOf(scratch_.file());
  damaged[16] = static_cast<char>(damaged[16] ^ 0x40);  // of the header
  put(scratch_.file(), damaged);
  for (const rlim_t room : {rlim_t{0}, rlim_t{8192}, rlim_t{damaged.size() / 2}}) {
    EXPECT_TRUE(support::holdsInChild([&] {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{room, room};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      auto store = Store::openAnyhow(scratch_.file());
      const auto all = decided::inState(store, State::active);
      return all && all->size() == kSubjects.size() && !store.whyNotWritable().empty() &&
             store.notice().find("What is whole in it can be read") != std::string::npos &&
             !store.propose(about("delay"), delayOf(1), "", "t3");
    })) << room;
    EXPECT_TRUE(contentOf(scratch_.file()) == damaged) << room;
  }
  auto store = reopened();
  EXPECT_THAT(store.notice(), HasSubstr("13 results"));
  EXPECT_EQ(decided::inState(store, State::active)->size(), kSubjects.size());
}

TEST_F(Damage, AStoreOfAnotherVersionIsLeftAloneAndTheBoxStarts) {
  fill();
  ASSERT_EQ(sql("ALTER TABLE results ADD COLUMN later TEXT; PRAGMA user_version = 70"), "");
  const auto before = contentOf(scratch_.file());
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(store.whyNotWritable(), HasSubstr("another schema"));
  EXPECT_EQ(contentOf(scratch_.file()), before);
}

}  // namespace
}  // namespace probebox::store
