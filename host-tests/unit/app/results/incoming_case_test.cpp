#include "firmware/app/results/incoming_case.hpp"

#include <functional>
#include <gmock/gmock.h>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages/cases.hpp"

namespace probebox::app {
namespace {

using Piece = messages::ProposeCase::Request;
using testing::AllOf;
using testing::HasSubstr;

Piece piece(std::uint32_t number, bool first, bool last) {
  return {.number = number, .first = first, .last = last, .method = "centreline", .config = {}, .columns = {}};
}

TEST(IncomingCase, IsPutTogetherFromItsPieces) {
  IncomingCase incoming;
  auto one = piece(7, true, false);
  one.config = {{.key = "robust", .kind = messages::CaseValue::flag, .numbers = {1}, .columns = 0, .text = {}},
                {.key = "sigma_mm", .kind = messages::CaseValue::number, .numbers = {0.001}, .columns = 0, .text = {}},
                {.key = "axis", .kind = messages::CaseValue::text, .numbers = {}, .columns = 0, .text = "C"},
                {.key = "point", .kind = messages::CaseValue::numbers, .numbers = {1, 2, 3}, .columns = 0, .text = {}}};
  one.columns = {{.table = "readings", .column = "x_mm", .values = {1, 2}}};
  const auto nothing_yet = incoming.add(one);
  ASSERT_TRUE(nothing_yet.ok());
  EXPECT_FALSE(*nothing_yet);
  auto two = piece(7, false, true);
  two.config = {
      {.key = "gain", .kind = messages::CaseValue::matrix, .numbers = {1, 2, 3, 4}, .columns = 2, .text = {}}};
  two.columns = {{.table = "readings", .column = "x_mm", .values = {3}},
                 {.table = "readings", .column = "y_mm", .values = {4, 5, 6}}};
  const auto whole = incoming.add(two);
  ASSERT_TRUE(whole.ok() && *whole);
  const metrology::Dataset expected{
      .method = "centreline",
      .config = {{"robust", true},
                 {"sigma_mm", 0.001},
                 {"axis", std::string{"C"}},
                 {"point", std::vector<double>{1, 2, 3}},
                 {"gain", metrology::Matrix{{1, 2}, {3, 4}}}},
      .tables = {{.name = "readings", .columns = {{"x_mm", {1, 2, 3}}, {"y_mm", {4, 5, 6}}}}}};
  EXPECT_EQ(**whole, expected);
}

// Who proposes a case may write anything into it; only a measurement of the box itself is traceable to a certificate.
TEST(IncomingCase, DoesNotClaimACertificateOfTheSphere) {
  for (const std::string key : {"sphere_certificate", "sphere_next_due"}) {
    for (const auto kind : {messages::CaseValue::text, messages::CaseValue::number}) {
      IncomingCase incoming;
      auto claiming = piece(7, false, true);
      claiming.config = {{.key = key, .kind = kind, .numbers = {20280417}, .columns = 0, .text = "2028-04-17"}};
      ASSERT_TRUE(incoming.add(piece(7, true, false)).ok());
      const auto answer = incoming.add(claiming);
      ASSERT_FALSE(answer.ok()) << key;
      EXPECT_THAT(answer.error().what, AllOf(HasSubstr("'" + key + "'"), HasSubstr("config.json")));
      EXPECT_FALSE(incoming.add(piece(7, false, true)).ok()) << "it is discarded";
    }
  }
}

TEST(IncomingCase, IsNotMixedWithAnother) {
  IncomingCase incoming;
  ASSERT_TRUE(incoming.add(piece(7, true, false)).ok());
  ASSERT_TRUE(incoming.add(piece(8, true, false)).ok()) << "the newer one";
  EXPECT_THAT(incoming.add(piece(7, false, true)).error().what, HasSubstr("another case"));
  EXPECT_FALSE(incoming.add(piece(9, false, true)).ok()) << "it never began";
  EXPECT_TRUE(incoming.add(piece(8, false, true)).ok());
  EXPECT_FALSE(incoming.add(piece(8, false, true)).ok()) << "it is over";
}

TEST(IncomingCase, RefusesEntriesThatAreNotOfTheirKindAndForgetsTheCase) {
  for (const auto& wrong :
       {messages::CaseEntry{.key = "k", .kind = messages::CaseValue::number, .numbers = {}, .columns = 0, .text = {}},
        {.key = "k", .kind = messages::CaseValue::flag, .numbers = {1, 2}, .columns = 0, .text = {}},
        {.key = "k", .kind = messages::CaseValue::matrix, .numbers = {1, 2, 3}, .columns = 2, .text = {}},
        {.key = "k", .kind = messages::CaseValue::matrix, .numbers = {1, 2, 3}, .columns = 0, .text = {}},
        {.key = "k", .kind = static_cast<messages::CaseValue>(9), .numbers = {1}, .columns = 0, .text = {}}}) {
    IncomingCase incoming;
    auto bad = piece(1, true, false);
    bad.config = {wrong};
    EXPECT_THAT(incoming.add(bad).error().what, HasSubstr("'k'"));
    EXPECT_FALSE(incoming.add(piece(1, false, true)).ok());
  }
}

// Sends pieces that differ in their number until one is refused; gives what was said and how many were taken.
std::pair<std::string, std::size_t> sendUntilRefused(const std::function<void(Piece&, std::size_t)>& fill) {
  IncomingCase incoming;
  for (std::size_t sent = 0; sent < 1'000'000; ++sent) {
    auto next = piece(1, sent == 0, false);
    fill(next, sent);
    if (const auto added = incoming.add(next); !added) return {added.error().what, sent};
  }
  return {};
}

TEST(IncomingCase, HasAnEndInRows) {
  const auto [said, taken] = sendUntilRefused([](Piece& next, std::size_t) {
    next.columns = {{.table = "t", .column = "x", .values = std::vector<double>(1000)}};
  });
  EXPECT_THAT(said,
              AllOf(HasSubstr("too-many-rows"), HasSubstr("'t'"), HasSubstr("250000"), HasSubstr("probebox solve")));
  EXPECT_EQ(taken, 250U);
}

TEST(IncomingCase, HasAnEndInColumns) {
  const auto [said, taken] = sendUntilRefused([](Piece& next, std::size_t sent) {
    next.columns = {{.table = "t" + std::to_string(sent % 7), .column = std::to_string(sent), .values = {}}};
  });
  EXPECT_THAT(said, AllOf(HasSubstr("too-many-columns"), HasSubstr("256")));
  EXPECT_EQ(taken, 256U);
}

TEST(IncomingCase, HasAnEndInNumbersOfAllTables) {
  const auto [said, taken] = sendUntilRefused([](Piece& next, std::size_t sent) {
    next.columns = {{.table = "t", .column = std::to_string(sent), .values = std::vector<double>(100'000)}};
  });
  EXPECT_THAT(said, AllOf(HasSubstr("too-large"), HasSubstr("8 MB"), HasSubstr("probebox solve")));
  EXPECT_EQ(taken, 10U) << "a million numbers of 8 bytes are less than 8 MB by 388608 bytes";
}

// What a map needs for a key counts, not its letters alone.
TEST(IncomingCase, CountsShortEntriesAsTheMemoryThatTheyTake) {
  const auto [said, taken] = sendUntilRefused([](Piece& next, std::size_t sent) {
    next.config = {
        {.key = std::to_string(sent), .kind = messages::CaseValue::text, .numbers = {}, .columns = 0, .text = "x"}};
  });
  EXPECT_THAT(said, HasSubstr("too-large"));
  EXPECT_LT(taken, IncomingCase::kMostBytes / 150) << "a node of the map is that large at least";
}

TEST(IncomingCase, CountsShortRowsOfAMatrixAsTheMemoryThatTheyTake) {
  const auto [said, taken] = sendUntilRefused([](Piece& next, std::size_t sent) {
    next.config = {{.key = std::to_string(sent),
                    .kind = messages::CaseValue::matrix,
                    .numbers = std::vector<double>(300),
                    .columns = 1,
                    .text = {}}};
  });
  EXPECT_THAT(said, HasSubstr("too-large"));
  EXPECT_LT(taken, IncomingCase::kMostBytes / (300 * 48));
}

}  // namespace
}  // namespace probebox::app
