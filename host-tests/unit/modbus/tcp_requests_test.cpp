#include "firmware/modbus/tcp_requests.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <string>
#include <vector>

namespace probebox::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes frameOf(std::uint16_t transaction, const Bytes& unit_and_function) {
  const auto high = [](std::size_t word) { return static_cast<std::uint8_t>(word >> 8); };
  const auto low = [](std::size_t word) { return static_cast<std::uint8_t>(word); };
  Bytes frame{high(transaction), low(transaction), 0, 0, high(unit_and_function.size()), low(unit_and_function.size())};
  frame.insert(frame.end(), unit_and_function.begin(), unit_and_function.end());
  return frame;
}

// All requests in the bytes, offered in parts as they come.
std::vector<TcpRequest> found(TcpRequests& requests, std::span<const std::uint8_t> bytes, std::size_t part) {
  std::vector<TcpRequest> all;
  while (!bytes.empty()) {
    const auto count = requests.push(std::as_bytes(bytes.first(std::min(part, bytes.size()))));
    bytes = bytes.subspan(count);
    while (const auto request = requests.next()) all.push_back(*request);
  }
  return all;
}

Bytes asSerial(Bytes bytes) {
  const auto crc = crc16(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

RC_GTEST_PROP(TcpRequests, AreFoundInOrderHoweverTheyAreCut, (std::vector<std::pair<std::uint16_t, Bytes>> asked)) {
  Bytes stream;
  for (auto& [transaction, body] : asked) {
    if (body.size() > 252) body.resize(252);
    while (body.size() < 2) body.push_back(3);
    body[1] &= 127U;
    const auto frame = frameOf(transaction, body);
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  TcpRequests requests;
  const auto all = found(requests, stream, *rc::gen::inRange<std::size_t>(1, 600));
  RC_ASSERT(all.size() == asked.size());
  RC_ASSERT(!requests.broken());
  for (std::size_t k = 0; k < all.size(); ++k) {
    RC_ASSERT(all[k].transaction == asked[k].first);
    RC_ASSERT(all[k].unit == asked[k].second[0]);
    const auto& request = all[k].request;
    RC_ASSERT((Bytes{request.bytes.begin(), request.bytes.begin() + static_cast<std::ptrdiff_t>(request.size)}) ==
              asSerial(asked[k].second));
  }
}

TEST(TcpRequests, OfTheLongestLengthAreFound) {
  TcpRequests requests;
  const auto all = found(requests, frameOf(1, Bytes(254, 7)), 1000);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].request.size, kMaxFrameBytes);
}

TEST(TcpRequests, EndForGoodWhereNoHeaderIs) {
  const std::string post = "POST / HTTP/1.1";
  auto protocol = frameOf(1, {1, 3, 0, 5, 0, 1});
  protocol[3] = 1;
  for (const auto& bad : {Bytes{post.begin(), post.end()}, protocol, frameOf(1, {1}), frameOf(1, {}),
                          frameOf(1, Bytes(255, 1)), frameOf(1, {1, 0x83, 2})}) {
    TcpRequests requests;
    EXPECT_TRUE(found(requests, bad, 3).empty());
    EXPECT_TRUE(requests.broken());
    EXPECT_TRUE(found(requests, frameOf(1, {1, 3, 0, 5, 0, 1}), 100).empty());
  }
}

TEST(TcpRequests, ThatAreNotWholeAreWaitedFor) {
  TcpRequests requests;
  const auto frame = frameOf(1, {1, 3, 0, 5, 0, 1});
  for (std::size_t k = 0; k + 1 < frame.size(); ++k) {
    EXPECT_TRUE(found(requests, std::span{frame}.subspan(k, 1), 1).empty());
    EXPECT_FALSE(requests.broken());
  }
  EXPECT_EQ(found(requests, std::span{frame}.last(1), 1).size(), 1U);
}

// The example of the implementation guide, section 3.1.3: unit 0xFF reads register 5, which is 5.
TEST(TcpAnswer, HasTheTransactionAndUnitOfItsRequestAndNoCrc) {
  const TcpRequest asked{.transaction = 0x1501, .unit = 0xFF, .request = {}};
  std::array<std::uint8_t, kMaxTcpFrameBytes> frame{};
  const auto size = tcpAnswer(asked, asSerial({1, 3, 2, 0, 5}), frame);
  const Bytes expected{0x15, 0x01, 0, 0, 0, 5, 0xFF, 3, 2, 0, 5};
  EXPECT_EQ((Bytes{frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)}), expected);
  EXPECT_EQ(tcpAnswer(asked, {}, frame), 0U);
}

}  // namespace
}  // namespace probebox::modbus
