#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>

#include "scratch.hpp"
#include "store_of_schema_5.hpp"

// What becomes of the results of an earlier version, whose subjects held several quantities.
namespace probebox::store {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

class EarlierSubjects : public testing::Test {
 protected:
  EarlierSubjects() { scratch_.change(kSchema5); }
  static Binding about(const char* subject, const char* mounting = "spindle") {
    return {subject, "P-1001", "mill 3", mounting};
  }

  Scratch scratch_;
};

const std::map<Id, std::string> kMeant{
    {1, "delay"},          {2, "centreline"},         {3, "centreline-stylus"}, {4, "centreline-stylus"},
    {5, "centreline"},     {6, "centreline-slide"},   {7, "centreline-stylus"}, {8, "centreline-stylus"},
    {9, "spindle-offset"}, {10, "spindle-offset"},    {11, "head-pivot"},       {12, "head-pivot"},
    {13, "check"},         {14, "centreline-stylus"}, {15, "delay-joints"},     {16, "centreline-stylus"}};

TEST_F(EarlierSubjects, BecomeThoseThatTheirMethodsMean) {
  auto store = Store::open(scratch_.file()).value();
  EXPECT_THAT(store.damage(), IsEmpty());
  for (const auto& [id, subject] : kMeant) EXPECT_EQ(store.find(id)->binding.subject, subject) << id;
  EXPECT_FALSE(*store.active(about("centreline"))) << "a tip's centreline is served as no spindle's";
  EXPECT_EQ((*store.active(about("centreline-stylus")))->id, 3U);
  EXPECT_EQ((*store.active(about("centreline-stylus", "bench")))->id, 16U);
  EXPECT_EQ((*store.active(about("delay")))->id, 1U);
  EXPECT_EQ(store.find(5)->state, State::accepted);
  EXPECT_THAT(store.notice(), AllOf(HasSubstr("result 3 of centreline-limited-access is about centreline-stylus now"),
                                    HasSubstr("spindle-offset-2x2"), Not(HasSubstr("result 9"))));
}

TEST_F(EarlierSubjects, KeepTheirValuesTheirDataAndTheirHistory) {
  auto store = Store::open(scratch_.file()).value();
  const auto third = store.find(3).value();
  EXPECT_EQ(third.result()->find("centre_mm")->values, (std::vector{0.174, -0.1233}));
  EXPECT_EQ(third.accepted_by, "Ada");
  EXPECT_EQ(store.dataset(3).value(), R"({"method":"of an earlier version"})");
  const auto second = store.history(2).value();
  ASSERT_THAT(second, SizeIs(4));
  EXPECT_EQ(second.back().to, State::retired);
  EXPECT_EQ(second.back().utc, store.history(3)->back().utc) << "when the third came into force";
  EXPECT_EQ(store.rollBack(about("centreline"), "Grace", "t9")->active->id, 2U);
  EXPECT_THAT(store.notice(), Not(IsEmpty()));
  EXPECT_THAT(Store::open(scratch_.file())->notice(), IsEmpty()) << "said once";
}

TEST_F(EarlierSubjects, ThatAreOneNowKeepTheResultAcceptedLast) {
  auto store = Store::open(scratch_.file()).value();
  for (const auto& [subject, older, newer] :
       {std::tuple{"spindle-offset", Id{9}, Id{10}}, std::tuple{"head-pivot", Id{11}, Id{12}}}) {
    EXPECT_EQ((*store.active(about(subject)))->id, newer);
    EXPECT_EQ(store.find(older)->state, State::retired);
    EXPECT_EQ(store.find(older)->retired_utc, store.find(newer)->accepted_utc);
    EXPECT_EQ(store.history(older)->back().to, State::retired);
    EXPECT_EQ(store.rollBack(about(subject), "Grace", "t9")->active->id, older);
  }
}

TEST_F(EarlierSubjects, NeverMakeADamagedRowWhole) {
  scratch_.change("UPDATE results SET result_json = replace(result_json, '-12.301', '-12.401') WHERE id = 12");
  auto store = Store::open(scratch_.file()).value();
  EXPECT_FALSE(store.find(12));
  EXPECT_EQ((*store.active(about("head-pivot")))->id, 11U);
  EXPECT_THAT(store.damage(), testing::ElementsAre(HasSubstr("result 12")));
}

// Every row that is whole is taken over under what it means, though the file is of the earlier version.
TEST_F(EarlierSubjects, OfADamagedFileAreAssignedToo) {
  scratch_.change("PRAGMA user_version = 3");
  auto store = Store::open(scratch_.file()).value();
  EXPECT_THAT(store.notice(), AllOf(HasSubstr("the 16 results of it that are whole"), HasSubstr("centreline-stylus")));
  for (const auto& [id, subject] : kMeant) EXPECT_EQ(store.find(id)->binding.subject, subject) << id;
}

class Dependences : public testing::Test {
 protected:
  Scratch scratch_;
  Store store_ = Store::open(scratch_.file()).value();
};

TEST_F(Dependences, AreKeptWithWhatBecameOfTheOtherResult) {
  const auto first = store_.propose(kBinding, delayOf(1), "", "t0").value();
  ASSERT_TRUE(store_.accept(first, "Ada", "t1"));
  Binding other = kBinding;
  other.subject = "centreline";
  const auto second = store_.propose(other, delayOf(2), "", "t2", {.rests_on = {first}}).value();
  EXPECT_THAT(store_.restsOn(first).value(), IsEmpty());
  ASSERT_THAT(store_.restsOn(second).value(), SizeIs(1));
  EXPECT_EQ(store_.restsOn(second)->front().id, first);
  EXPECT_EQ(store_.restsOn(second)->front().subject, "delay");
  EXPECT_TRUE(store_.restsOn(second)->front().in_force);
  ASSERT_TRUE(store_.accept(store_.propose(kBinding, delayOf(3), "", "t3").value(), "Ada", "t4"));
  store_ = Store::open(scratch_.file()).value();
  EXPECT_FALSE(store_.restsOn(second)->front().in_force);
}

TEST_F(Dependences, RemarksAreKeptInTheHistoryWithWhoMadeThem) {
  const auto id = store_.propose(kBinding, delayOf(1), "", "t0", {.by = "Grace", .remark = "as this machine"}).value();
  ASSERT_TRUE(store_.accept(id, "Ada", "t1", Activation::at_once, "although it differs"));
  const auto history = store_.history(id).value();
  ASSERT_THAT(history, SizeIs(3));
  EXPECT_EQ(history[0].by, "Grace");
  EXPECT_EQ(history[0].remark, "as this machine");
  EXPECT_EQ(history[1].remark, "although it differs");
  EXPECT_EQ(history[2].remark, "");
}

TEST_F(Dependences, ThatAreDamagedAreSaid) {
  const auto first = store_.propose(kBinding, delayOf(1), "", "t0", {.by = "Grace", .remark = "as this machine"});
  ASSERT_TRUE(store_.propose(kBinding, delayOf(1), "", "t0", {.rests_on = {*first}}));
  sqlite3* hand{};
  sqlite3_open(scratch_.file().c_str(), &hand);
  sqlite3_exec(hand, "UPDATE remarks SET text = 'x'; UPDATE dependences SET rests_on = 2", nullptr, nullptr, nullptr);
  sqlite3_close(hand);
  EXPECT_EQ(store_.history(*first)->front().remark, "");
  EXPECT_THAT(store_.restsOn(*first + 1).value(), IsEmpty());
  EXPECT_THAT(store_.damage(), testing::ElementsAre(HasSubstr("not shown: 2")));
}

}  // namespace
}  // namespace probebox::store
