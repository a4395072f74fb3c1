#include "firmware/app/cnc/register_handler.hpp"

#include <gtest/gtest.h>

#include "host-tests/numbered/snapshot.hpp"

// What a controller is known to have read: after the end of a box it decides where the joints stand.
namespace probebox::app {
namespace {

modbus::Request writeRequest(std::uint16_t address, std::uint16_t value) {
  auto request = support::readRequest(address, value);
  request.bytes[1] = 6;
  const auto crc = modbus::crc16(std::span{request.bytes}.first(6));
  request.bytes[6] = static_cast<std::uint8_t>(crc);
  request.bytes[7] = static_cast<std::uint8_t>(crc >> 8U);
  return request;
}

class Desk : public testing::Test {
 protected:
  void answer(const modbus::Request& request) {
    EXPECT_EQ(handler_.answer(request).kind, RegisterHandler::Answer::Kind::answered);
  }
  void read(std::uint16_t first, std::uint16_t count) { answer(support::readRequest(first, count)); }

  std::uint32_t number_{1};
  std::uint64_t served_{};  // number of the snapshot whose correction was read last

 private:
  RegisterHandler handler_{1,
                           "1.2.3",
                           {.snapshot = [this] { return support::numbered(number_); },
                            .take = [](std::span<const Event>) { return true; },
                            .kept = [] { return RegisterHandler::Kept{}; },
                            .serves = [this](const published::Snapshot& snapshot,
                                             std::string_view) { served_ = snapshot.ledger.produced; }}};
};

TEST_F(Desk, KnowsThatACorrectionWasReadInEveryFormat) {
  for (const auto& [first, count] :
       {std::pair{0, 13}, {0, 6}, {7, 1}, {10, 5}, {16, 2}, {21, 1}, {32, 6}, {37, 40}, {0, 122}}) {
    ++number_;
    read(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(count));
    EXPECT_EQ(served_, number_) << first << " " << count;
  }
}

TEST_F(Desk, TakesNoOtherRequestForIt) {
  for (const auto& [first, count] : {std::pair{0, 5}, {11, 5}, {22, 10}, {38, 80}, {96, 8}}) {
    ++number_;
    read(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(count));
    EXPECT_EQ(served_, 0U) << first << " " << count;
  }
  const auto cut = writeRequest(138, 1);
  answer(cut);
  EXPECT_EQ(served_, 0U) << "an inhibit is written";
}

RegisterHandler::Callbacks callbacksOfAnybody() {
  return {.snapshot = [] { return support::numbered(1); },
          .take = [](std::span<const Event>) { return true; },
          .kept = [] { return RegisterHandler::Kept{}; },
          .keep = [](modbus::WordOrder) { return true; }};
}

TEST(DeskOfAReader, TakesNoWriteButTheOrderOfItsOwnWords) {
  auto callbacks = callbacksOfAnybody();
  callbacks.only_looks = true;
  RegisterHandler handler{1, "1.2.3", std::move(callbacks)};
  for (const std::uint16_t address : std::initializer_list<std::uint16_t>{138, 147, 157, 800, 837}) {
    EXPECT_EQ(handler.answer(writeRequest(address, 0)).kind, RegisterHandler::Answer::Kind::refused) << address;
  }
  EXPECT_EQ(handler.answer(writeRequest(128, 1)).kind, RegisterHandler::Answer::Kind::answered);
}

// The disk refuses the inhibit, which holds in memory and reads 1: nothing changes when the controller says it again.
TEST(DeskOfAController, AcknowledgesARepeatedInhibitWhenItIsTaken) {
  auto callbacks = callbacksOfAnybody();
  bool inhibits = false, disk_writes = false;
  callbacks.take = [&](std::span<const Event> said) {
    for (const auto& event : said) inhibits = std::get<CutInhibit>(event).active;
    return disk_writes;
  };
  callbacks.kept = [&] { return RegisterHandler::Kept{.inhibits = inhibits}; };
  RegisterHandler handler{1, "1.2.3", std::move(callbacks)};
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(handler.answer(writeRequest(138, 1)).kind, RegisterHandler::Answer::Kind::refused) << i;
  disk_writes = true;
  EXPECT_EQ(handler.answer(writeRequest(138, 1)).kind, RegisterHandler::Answer::Kind::answered);
}

TEST(DeskOfAController, TakesNoRequestThatItsLineMayNotMake) {
  auto callbacks = callbacksOfAnybody();
  int made = 0;
  callbacks.controller_request = [&](const modbus::ControllerRequest&) { ++made; };
  callbacks.may_request = [](const modbus::ControllerRequest& controller_request) {
    return controller_request.what != modbus::ControllerRequest::What::start;
  };
  RegisterHandler handler{1, "1.2.3", std::move(callbacks)};
  handler.answer(writeRequest(836, 1));
  EXPECT_EQ(handler.answer(writeRequest(837, 7)).kind, RegisterHandler::Answer::Kind::refused);
  EXPECT_EQ(made, 0);
  handler.answer(writeRequest(836, 2));
  EXPECT_EQ(handler.answer(writeRequest(837, 7)).kind, RegisterHandler::Answer::Kind::answered)
      << "nothing was committed before";
  EXPECT_EQ(made, 1);
}

}  // namespace
}  // namespace probebox::app
