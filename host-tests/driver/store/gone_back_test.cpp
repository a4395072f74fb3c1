#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/store/copy_before.hpp"
#include "firmware/store/schema.hpp"
#include "host-tests/support/file_content.hpp"
#include "scratch.hpp"
#include "store_of_schema_5.hpp"

// A box goes back to the version before after a newer one has changed the store's schema. The newer version is played:
// it keeps the copy with this program's function, then changes a table.
namespace probebox::store {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

class GoneBack : public testing::Test {
 protected:
  // Result 1 in force, result 2 proposed.
  void fill() const {
    auto store = Store::open(scratch_.file()).value();
    ASSERT_TRUE(store.accept(store.propose(kBinding, delayOf(0.1), "", "t0").value(), "Ada", "t1"));
    ASSERT_TRUE(store.propose(kBinding, delayOf(0.2), "measured", "t2"));
  }
  void migrateByANewerVersion() const {
    {
      auto database = Database::open(scratch_.file()).value();
      ASSERT_TRUE(keepCopyBefore(database, knownSchema()));
    }
    scratch_.change("ALTER TABLE results ADD COLUMN later TEXT; PRAGMA user_version = 99");
  }
  std::string copyOfSchema(std::int64_t schema) const { return scratch_.file() + ".schema-" + std::to_string(schema); }
  std::string copy() const { return copyOfSchema(knownSchema()); }

  Scratch scratch_;
};

TEST_F(GoneBack, AMigrationKeepsACopyOfTheStoreAsItWasAndNoOlderOne) {
  std::ofstream{copyOfSchema(4)} << "of an earlier update";
  std::ofstream{copyOfSchema(5)} << "half written";
  scratch_.change(kSchema5);
  ASSERT_TRUE(Store::open(scratch_.file()));
  EXPECT_FALSE(std::filesystem::exists(copyOfSchema(4)));
  auto kept = Database::openToRead(copyOfSchema(5)).value();
  EXPECT_EQ(kept.number("PRAGMA user_version").value(), 5);
  EXPECT_EQ(kept.number("SELECT count(*) FROM results").value(), 16);
  EXPECT_EQ(kept.text("PRAGMA integrity_check").value(), "ok");
  ASSERT_TRUE(Store::open(scratch_.file()));
  EXPECT_TRUE(std::filesystem::exists(copyOfSchema(5))) << "also after the next start";
}

TEST_F(GoneBack, NothingIsMigratedWithoutACopy) {
  scratch_.change(kSchema5);
  std::filesystem::create_directories(copyOfSchema(5) + "/in the way");
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(store.whyNotWritable(), HasSubstr(copyOfSchema(5) + " cannot be opened"));
  EXPECT_EQ(store.active({"delay", "P-1001", "mill 3", "spindle"}).value()->id, 1U) << "what was in force still is";
  EXPECT_EQ(Database::openToRead(scratch_.file())->number("PRAGMA user_version").value(), 5);
}

TEST_F(GoneBack, ResultsOfBeforeStayInForceWhileTheyHold) {
  fill();
  migrateByANewerVersion();
  scratch_.change("INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (3, 0, 't3', '')");  // a proposal
  const auto before = support::contentOf(scratch_.file());
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_EQ(store.active(kBinding).value()->id, 1U);
  EXPECT_EQ(store.dataset(2).value(), "measured");
  EXPECT_THAT(store.notice(), AllOf(HasSubstr("schema 99"), HasSubstr("install that version again (probebox update"),
                                    HasSubstr("put the copy " + copy() + " in the place of the file")));
  EXPECT_THAT(store.accept(2, "Ada", "t4").error().what,
              AllOf(HasSubstr("nothing can be stored"), HasSubstr("written by a newer version")));
  EXPECT_EQ(support::contentOf(scratch_.file()), before);
}

// What was in force before may be wrong for the machine as it is now.
TEST_F(GoneBack, ResultsThatWereReplacedSinceDoNotComeBackByThemselves) {
  fill();
  migrateByANewerVersion();
  scratch_.change("INSERT INTO transitions (result_id, state, utc, by_whom) VALUES (2, 2, 't3', 'Ada')");
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(*store.newest(10), IsEmpty());
  EXPECT_THAT(store.notice(),
              AllOf(HasSubstr("Nothing of it can be read"), HasSubstr("put the copy " + copy() +
                                                                      " in the place of the file, with the results "
                                                                      "that were in force before")));
}

TEST_F(GoneBack, ResultsOfAVersionWhoseHistoryCannotBeReadCountAsReplaced) {
  fill();
  migrateByANewerVersion();
  scratch_.change("ALTER TABLE transitions RENAME TO history");
  EXPECT_THAT(*Store::openAnyhow(scratch_.file()).newest(10), IsEmpty());
}

TEST_F(GoneBack, ACopyThatIsDamagedIsNamed) {
  fill();
  migrateByANewerVersion();
  scratch_.change("DROP TABLE datasets", copy());
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(*store.newest(10), IsEmpty());
  EXPECT_THAT(store.notice(), AllOf(HasSubstr("Neither can the copy of before: " + copy() + " is damaged"),
                                    Not(HasSubstr("Until then"))));
}

TEST_F(GoneBack, WithoutACopyTheNewerVersionIsTheRemedy) {
  fill();
  migrateByANewerVersion();
  std::filesystem::remove(copy());
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(*store.newest(10), IsEmpty());
  EXPECT_THAT(store.notice(), AllOf(HasSubstr("install that version again"), Not(HasSubstr("copy"))));
}

// What the notice tells a person to do.
TEST_F(GoneBack, TheCopyInThePlaceOfTheFileIsAStoreAsBefore) {
  fill();
  migrateByANewerVersion();
  std::filesystem::rename(copy(), scratch_.file());
  auto store = Store::openAnyhow(scratch_.file());
  EXPECT_THAT(store.notice(), IsEmpty());
  EXPECT_THAT(*store.newest(10), SizeIs(2));
  EXPECT_TRUE(store.accept(2, "Ada", "t4"));
}

}  // namespace
}  // namespace probebox::store
