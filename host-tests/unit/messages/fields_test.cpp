#include "protocol/messages/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"

namespace probebox::messages {
namespace {

using testing::ElementsAre;

struct Inner {
  std::uint8_t a{1};
  std::uint16_t b{2};
  static constexpr void fields(auto& self, auto&& field) {
    field("a", self.a, "");
    field("b", self.b, "");
  }
};

// The same structure as a version before knew it.
struct InnerBefore {
  std::uint8_t a{1};
  static constexpr void fields(auto& self, auto&& field) { field("a", self.a, ""); }
};

template <class T>
struct Outer {
  std::vector<T> list{};
  T one{};
  std::uint8_t last{};
  static constexpr void fields(auto& self, auto&& field) {
    field("list", self.list, "");
    field("one", self.one, "");
    field("last", self.last, "");
  }
};

std::vector<int> ints(const std::vector<std::byte>& bytes) {
  std::vector<int> all;
  for (const auto byte : bytes) all.push_back(std::to_integer<int>(byte));
  return all;
}

TEST(Fields, NestedStructuresCarryTheirSize) {
  const Outer<Inner> outer{{{5, 6}}, {7, 8}, 9};
  EXPECT_THAT(ints(encoded(outer)), ElementsAre(1, 0, 3, 0, 5, 6, 0, 3, 0, 7, 8, 0, 9));
}

TEST(Fields, NestedStructuresMayGrow) {
  const Outer<Inner> now{{{5, 6}, {7, 8}}, {9, 10}, 11};
  const auto read_before = decode<Outer<InnerBefore>>(encoded(now));
  ASSERT_TRUE(read_before.ok());
  ASSERT_EQ(read_before->list.size(), 2U);
  EXPECT_EQ(read_before->list[1].a, 7);
  EXPECT_EQ(read_before->last, 11);

  const Outer<InnerBefore> before{{{5}, {7}}, {9}, 11};
  const auto read_now = decode<Outer<Inner>>(encoded(before));
  ASSERT_TRUE(read_now.ok());
  EXPECT_EQ(read_now->list[1].a, 7);
  EXPECT_EQ(read_now->list[1].b, 2) << "the default";
  EXPECT_EQ(read_now->last, 11);
}

TEST(Fields, ACountThatLiesTakesNoMemory) {
  const std::array<std::byte, 3> lie{std::byte{0xFF}, std::byte{0xFF}, std::byte{0}};
  EXPECT_EQ(decode<Outer<Inner>>(lie).error(), WireError::truncated);
}

TEST(Fields, TooLongATextIsRefusedAndNotCut) {
  Refusal refusal;
  refusal.text = std::string(0x10000, 'x');
  std::vector<std::byte> room(0x20000);
  EXPECT_EQ(encode(refusal, room).error(), WireError::too_long);
  EXPECT_TRUE(encoded(refusal).empty());
  refusal.text.pop_back();
  EXPECT_TRUE(encode(refusal, room).ok());
}

TEST(Fields, ViewsReadTheSameBytesWithoutCopying) {
  const auto bytes = encoded(Request{7, Operation::get_dataset, {std::byte{1}, std::byte{2}}});
  const auto view = decode<RequestView>(bytes);
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view->body.size(), 2U);
  EXPECT_EQ(view->body.data(), bytes.data() + bytes.size() - 2);
  EXPECT_EQ(encoded(*view), bytes);
}

TEST(TestPatternMessage, HoldsEveryByteValueOnce) {
  auto sorted = TestPattern::expected().bytes;
  std::ranges::sort(sorted);
  for (std::size_t k = 0; k < sorted.size(); ++k) EXPECT_EQ(sorted[k], k);
}

TEST(Names, AreThereForEveryNumberAndUnknownBeyond) {
  EXPECT_EQ(nameOf(MessageType::hello), "HELLO");
  EXPECT_EQ(nameOf(MessageType::refusal), "REFUSAL");
  EXPECT_EQ(nameOf(ErrorCode::version_mismatch), "version_mismatch");
  EXPECT_EQ(nameOf(Operation::get_dataset), "get_dataset");
  EXPECT_EQ(nameOf(GapReason::resume_too_old), "resume_too_old");
  EXPECT_EQ(nameOf(RunState::aborted), "aborted");
  EXPECT_EQ(nameOf(static_cast<MessageType>(0)), "unknown");
  EXPECT_EQ(nameOf(static_cast<ErrorCode>(999)), "unknown");
}

}  // namespace
}  // namespace probebox::messages
