#include "firmware/app/results/incoming_case.hpp"

#include <gmock/gmock.h>

namespace probebox::app {
namespace {

using Piece = messages::ProposeCase::Request;
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

TEST(IncomingCase, IsNotMixedWithAnother) {
  IncomingCase incoming;
  ASSERT_TRUE(incoming.add(piece(7, true, false)).ok());
  ASSERT_TRUE(incoming.add(piece(8, true, false)).ok()) << "the newer one";
  EXPECT_THAT(incoming.add(piece(7, false, true)).error().what, HasSubstr("interrupted by another case"));
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

TEST(IncomingCase, HasAnEnd) {
  IncomingCase incoming;
  auto much = piece(1, true, false);
  much.columns = {{.table = "t", .column = "x", .values = std::vector<double>(60'000)}};
  auto added = incoming.add(much);
  much.first = false;
  for (std::size_t sent = 60'000; added.ok() && sent <= IncomingCase::kMostNumbers; sent += 60'000)
    added = incoming.add(much);
  ASSERT_FALSE(added.ok());
  EXPECT_THAT(added.error().what, HasSubstr("too large"));
}

}  // namespace
}  // namespace probebox::app
