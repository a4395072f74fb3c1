#include <csignal>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host-tests/decided/decided.hpp"
#include "host-tests/support/file_content.hpp"
#include "host-tests/support/in_child.hpp"
#include "scratch.hpp"

namespace probebox::store {
namespace {

using support::contentOf;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Another program's hand on the same file.
class Hand {
 public:
  explicit Hand(const std::string& path) { sqlite3_open(path.c_str(), &handle_); }
  ~Hand() { sqlite3_close(handle_); }
  void run(const char* sql) { ASSERT_EQ(sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sql; }

 private:
  sqlite3* handle_{};
};

void write(const std::string& path, const std::string& content) {
  std::ofstream{path, std::ios::binary | std::ios::trunc} << content;
}

std::string filledStore(const Scratch& scratch) {
  auto store = Store::open(scratch.file()).value();
  for (int i = 0; i < 20; ++i) {
    const auto id = store.propose(kBinding, delayOf(i), std::string(2000, 'x'), "t0").value();
    EXPECT_TRUE(decided::accept(store, id, "Ada", "t1"));
  }
  return contentOf(scratch.file());
}

TEST(StoreOpening, MakesAMissingFileAndSaysNothing) {
  const Scratch scratch;
  const auto store = Store::open(scratch.file());
  ASSERT_TRUE(store);
  EXPECT_THAT(store->notice(), IsEmpty());
}

TEST(StoreOpening, NamesAMissingDirectory) {
  const Scratch scratch;
  const auto store = Store::open((scratch.directory() / "absent" / "results.db").string());
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().reason, Reason::unavailable);
  EXPECT_THAT(store.error().what, HasSubstr("absent/results.db"));
}

TEST(StoreOpening, MovesADamagedFileAsideWithEveryByteOfIt) {
  const Scratch scratch;
  const auto sound = filledStore(scratch);
  std::mt19937 random{20261121};
  for (int trial = 1; trial <= 20; ++trial) {
    auto damaged = sound;
    // Whole pages, so that no trial hits only unused bytes of a page.
    const auto pages = sound.size() / 4096;
    const auto page = std::uniform_int_distribution<std::size_t>{1, pages - 1}(random);
    for (std::size_t i = 0; i < 4096; ++i) damaged[page * 4096 + i] = static_cast<char>(random());
    write(scratch.file(), damaged);
    const auto store = Store::open(scratch.file());
    ASSERT_TRUE(store) << store.error().what;
    const auto aside = scratch.file() + ".damaged-" + std::to_string(trial);
    EXPECT_THAT(store->notice(), HasSubstr(aside));
    EXPECT_EQ(contentOf(aside), damaged);
  }
}

TEST(StoreOpening, NeverSilentlyReplacesAFileOfGarbageOrACutOne) {
  const Scratch scratch;
  const auto sound = filledStore(scratch);
  const std::vector<std::string> broken{
      "this is not a database, and it is longer than a header of SQLite is by far....."
      "................................................................",
      sound.substr(0, sound.size() / 2), std::string(5000, '\0')};
  for (const auto& content : broken) {
    write(scratch.file(), content);
    auto store = Store::open(scratch.file());
    ASSERT_TRUE(store) << store.error().what;
    EXPECT_THAT(store->notice(), HasSubstr("moved to"));
    EXPECT_TRUE(store->propose(kBinding, delayOf(1), "", "t0"));
  }
}

TEST(StoreOpening, RefusesAnotherSchemaByNameAndLeavesItAlone) {
  const Scratch scratch;
  filledStore(scratch);
  Hand{scratch.file()}.run("ALTER TABLE results ADD COLUMN later TEXT; PRAGMA user_version = 99");
  const auto before = contentOf(scratch.file());
  const auto store = Store::open(scratch.file());
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().reason, Reason::other_schema);
  EXPECT_THAT(store.error().what, HasSubstr("schema (99)"));
  EXPECT_EQ(contentOf(scratch.file()), before);
}

TEST(StoreOpening, PutsADatabaseOfAnotherProgramAsideWithEveryByteOfIt) {
  const Scratch scratch;
  Hand{scratch.file()}.run("CREATE TABLE recipes (cake TEXT); INSERT INTO recipes VALUES ('lemon')");
  const auto before = contentOf(scratch.file());
  auto store = Store::open(scratch.file());
  ASSERT_TRUE(store) << store.error().what;
  EXPECT_THAT(store->notice(), AllOf(HasSubstr("another program"), HasSubstr(".foreign-1")));
  EXPECT_EQ(contentOf(scratch.file() + ".foreign-1"), before);
  EXPECT_TRUE(store->propose(kBinding, delayOf(1), "", "t0"));
}

TEST(StoreOpening, DoesNotTakeAnEmptyFileForANewStore) {
  const Scratch scratch;
  write(scratch.file(), "");
  auto store = Store::open(scratch.file());
  ASSERT_TRUE(store) << store.error().what;
  EXPECT_THAT(store->notice(), AllOf(HasSubstr("was empty"), HasSubstr(".empty-1")));
  EXPECT_TRUE(std::filesystem::exists(scratch.file() + ".empty-1"));
  EXPECT_TRUE(store->propose(kBinding, delayOf(1), "", "t0"));
}

TEST(StoreOpening, RemovesWhatAnInterruptedRepairHasLeft) {
  const Scratch scratch;
  filledStore(scratch);
  const std::vector<std::string> left{".new", ".new-journal", ".salvage", ".repaired", ".salvage-journal"};
  for (const auto& name : left) write(scratch.file() + name, "part");
  write(scratch.file() + ".damaged-1", "kept");
  auto store = Store::open(scratch.file());
  ASSERT_TRUE(store) << store.error().what;
  EXPECT_THAT(store->notice(), IsEmpty());
  EXPECT_EQ(decided::newest(*store, 100)->size(), 20U);
  for (const auto& name : left) EXPECT_FALSE(std::filesystem::exists(scratch.file() + name)) << name;
  EXPECT_EQ(contentOf(scratch.file() + ".damaged-1"), "kept");
}

TEST(StoreOpening, DoesNotTakeAnIncompleteNewStoreForTheOne) {
  const Scratch scratch;
  filledStore(scratch);
  std::filesystem::rename(scratch.file(), scratch.file() + ".new");
  auto store = Store::open(scratch.file());
  ASSERT_TRUE(store) << store.error().what;
  EXPECT_THAT(*decided::newest(*store, 100), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(scratch.file() + ".new"));
}

TEST(StoreOpening, NamesALockedFileAndWorksAgainAfterwards) {
  const Scratch scratch;
  auto store = Store::open(scratch.file()).value();
  const auto id = store.propose(kBinding, delayOf(1), "", "t0").value();
  {
    Hand other{scratch.file()};
    other.run("BEGIN EXCLUSIVE");
    const auto accepted = decided::accept(store, id, "Ada", "t1");
    ASSERT_FALSE(accepted);
    EXPECT_EQ(accepted.error().reason, Reason::unavailable);
    EXPECT_THAT(accepted.error().what, HasSubstr("locked"));
    other.run("COMMIT");
  }
  EXPECT_TRUE(decided::accept(store, id, "Ada", "t1"));
}

// Who opens a pipe waits for its other end, for ever.
TEST(StoreOpening, NamesWhatIsNoOrdinaryFile) {
  for (const char* const suffix : {"", "-journal"}) {
    const Scratch scratch;
    ASSERT_EQ(::mkfifo((scratch.file() + suffix).c_str(), 0600), 0);
    const auto refused = Store::open(scratch.file());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::unavailable);
    EXPECT_THAT(refused.error().what, HasSubstr(scratch.file() + suffix + " is no ordinary file"));
    auto store = Store::openAnyhow(scratch.file());
    EXPECT_THAT(store.whyNotWritable(), HasSubstr("ordinary file"));
  }
}

TEST(StoreOpening, SaysThatTheFileOfAnEarlierStartIsGone) {
  const Scratch scratch;
  {
    const auto store = Store::openAnyhow(scratch.file(), Before::had_it);
    EXPECT_THAT(store.notice(), HasSubstr("is gone"));
    EXPECT_THAT(store.whyNotWritable(), IsEmpty());
  }
  EXPECT_THAT(Store::openAnyhow(scratch.file(), Before::had_it).notice(), IsEmpty());
}

TEST(StoreOpening, NamesAReadOnlyFile) {
  const Scratch scratch;
  filledStore(scratch);
  namespace fs = std::filesystem;
  fs::permissions(scratch.file(), fs::perms{0444});
  fs::permissions(scratch.directory(), fs::perms{0555});
  EXPECT_TRUE(support::holdsInChild([&] {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::seteuid(kNobody) != 0) return false;
    const auto store = Store::open(scratch.file());
    return !store && store.error().reason == Reason::unavailable &&
           store.error().what.find("read-only") != std::string::npos;
  }));
  fs::permissions(scratch.directory(), fs::perms{0755});
}

// The limit on the file's size stands for a full disk: both make write() fail in mid-transaction.
TEST(StoreOpening, LosesNothingWhenTheDiskIsFull) {
  const Scratch scratch;
  filledStore(scratch);
  EXPECT_TRUE(support::holdsInChild([&] {
    auto store = Store::open(scratch.file()).value();
    std::signal(SIGXFSZ, SIG_IGN);
    const rlim_t size = std::filesystem::file_size(scratch.file());
    const rlimit limit{size, size};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const auto proposed = store.propose(kBinding, delayOf(1), std::string(100'000, 'x'), "t0");
    return !proposed && proposed.error().reason == Reason::unavailable &&
           proposed.error().what.find("nothing was changed") != std::string::npos;
  }));
  auto store = Store::open(scratch.file()).value();
  EXPECT_THAT(store.notice(), IsEmpty());
  EXPECT_EQ(decided::newest(store, 100)->size(), 20U);
  EXPECT_EQ(decided::active(store, kBinding).value()->id, 20U);
}

}  // namespace
}  // namespace probebox::store
