#include <algorithm>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "protocol/events/event.hpp"
#include "samples.hpp"

namespace probebox::messages {
namespace {

// Field by field, so that a decoder that skips one is seen.
template <Structure T>
bool sameFields(const T& a, const T& b) {
  return encoded(a) == encoded(b);
}

TEST(Messages, RoundTrip) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    const auto seed = *rc::gen::arbitrary<std::uint64_t>();
    forEachMessage([seed](const char* name, auto message) {
      Filler{seed}.fill(message);
      const auto bytes = encoded(message);
      RC_ASSERT(bytes.size() == encodedSize(message));
      const auto back = decode<decltype(message)>(bytes);
      if (!back.ok()) RC_FAIL(name);
      if (!sameFields(*back, message)) RC_FAIL(name);
    });
  }));
}

// A minor version that has fewer fields wrote it: what begins must be whole, what is not there is the default.
TEST(Messages, CutAnywhereAreRefusedOrAnOlderMinorVersion) {
  forEachMessage([](const char* name, auto message) {
    using Message = decltype(message);
    Filler{7}.fill(message);
    const auto bytes = encoded(message);
    std::vector<std::size_t> ends{0};
    Message::fields(message, [&](auto, const auto& member, auto&&...) {
      frame::ByteWriter writer{{}};
      detail::encodeValue(writer, member);
      ends.push_back(ends.back() + writer.size());
    });
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const bool at_field = std::ranges::find(ends, size) != ends.end();
      const auto cut = decode<Message>(std::span{bytes}.first(size));
      EXPECT_EQ(cut.ok(), at_field) << name << " cut to " << size;
      if (size > 0) continue;
      EXPECT_TRUE(sameFields(*cut, Message{})) << name;
    }
  });
}

TEST(Messages, OfALaterMinorVersionAreReadWithoutWhatIsNew) {
  forEachMessage([](const char* name, auto message) {
    Filler{3}.fill(message);
    auto bytes = encoded(message);
    bytes.insert(bytes.end(), 5, std::byte{0xEE});
    const auto back = decode<decltype(message)>(bytes);
    ASSERT_TRUE(back.ok()) << name;
    EXPECT_TRUE(sameFields(*back, message)) << name;
  });
}

TEST(Messages, NeedExactlyTheRoomTheySay) {
  forEachMessage([](const char* name, auto message) {
    Filler{11}.fill(message);
    std::vector<std::byte> room(encodedSize(message));
    EXPECT_TRUE(encode(message, room).ok()) << name;
    const auto refused = encode(message, std::span{room}.first(room.size() - 1));
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error(), WireError::no_room) << name;
  });
}

TEST(Messages, OfRandomBytesNeverReadBeyondTheirEnd) {
  EXPECT_TRUE(rc::check("decode of anything ends", [] {
    const auto values = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::weightedOneOf<std::uint8_t>(
        {{3, rc::gen::inRange<std::uint8_t>(0, 6)}, {1, rc::gen::arbitrary<std::uint8_t>()}}));
    const auto bytes = std::as_bytes(std::span{values});
    forEachMessage([bytes](const char*, auto message) {
      // What can be read can be written again.
      if (const auto read = decode<decltype(message)>(bytes)) RC_ASSERT(!encoded(*read).empty());
    });
  }));
}

TEST(Events, TravelInAJournalLikeMessages) {
  std::uint64_t seed = 1;
  const auto check = [&]<std::size_t K>(std::integral_constant<std::size_t, K>) {
    const Event event = Filler{++seed}.made<std::variant_alternative_t<K, Event>>();
    std::array<std::byte, 512> room{};  // as much as a journal has
    const auto size = encode(event, room);
    ASSERT_TRUE(size.ok());
    const auto back = decode<Event>(std::span<const std::byte>{room}.first(*size));
    ASSERT_TRUE(back.ok());
    ASSERT_EQ(back->index(), K);
    EXPECT_TRUE(sameFields(std::get<K>(*back), std::get<K>(event)));
  };
  [&]<std::size_t... K>(std::index_sequence<K...>) {
    (check(std::integral_constant<std::size_t, K>{}), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Event>>{});
}

TEST(Events, OfAnUnknownTypeAreRefused) {
  const std::array<std::byte, 1> unknown{std::byte{200}};
  EXPECT_EQ(decode<Event>(std::span<const std::byte>{unknown}).error(), WireError::unknown_alternative);
  EXPECT_EQ(decode<Event>(std::span<const std::byte>{}).error(), WireError::truncated);
}

}  // namespace
}  // namespace probebox::messages
