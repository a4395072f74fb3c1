#include <array>
#include <cerrno>
#include <cstdlib>
#include <gmock/gmock.h>

#include "drivers/usb_host/bulk_in.hpp"
#include "drivers/usb_host/bulk_out.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "on_a_bus.hpp"

namespace probebox::usb_host {
namespace {

using ::testing::HasSubstr;

constexpr TransferRing::Size kSmall{.transfers = 8, .transfer_bytes = 16 * 1024};
const MockBus::Device kBox{};
const std::string kPath = kBox.path;

std::vector<std::byte> joined(std::vector<std::byte> a, const std::vector<std::byte>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class Transfers : public OnABus {
 protected:
  void SetUp() override {
    OnABus::SetUp();
    if (IsSkipped()) return;
    bus_->plug(kBox);
    auto claimed = ClaimedInterface::open(usb::kLink, "");
    ASSERT_TRUE(claimed.ok()) << claimed.error().what;
    claimed_ = std::move(*claimed);
  }

  Endpoint endpoint(std::size_t index) const { return claimed_->device().endpoints.at(index); }
  int descriptor() const { return claimed_->context().descriptor(); }
  void deviceSends(std::span<const std::byte> bytes) { bus_->send(kPath, MockBus::kDataIn, bytes); }
  std::vector<std::byte> deviceReceived() { return bus_->received(kPath, MockBus::kDataOut); }

  static std::vector<std::byte> readAll(BulkIn& in, std::size_t most = 1U << 20U) {
    std::vector<std::byte> bytes(most);
    bytes.resize(in.read(bytes));
    return bytes;
  }

  std::unique_ptr<ClaimedInterface> claimed_;
};

TEST_F(Transfers, KeepsAllTransfersInFlight) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  EXPECT_EQ(bus_->inFlight(kPath, MockBus::kDataIn), 8U);
  EXPECT_EQ(in.inFlight(), 8U);
  deviceSends(pattern(100));
  EXPECT_EQ(readAll(in), pattern(100));
  EXPECT_EQ(bus_->inFlight(kPath, MockBus::kDataIn), 8U) << "what was read flies again";
}

TEST_F(Transfers, BringsEverythingInOrder) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  std::vector<std::byte> sent;
  std::vector<std::byte> got;
  for (std::size_t size = 1; size < 100'000; size = size * 3 + 7) {
    const auto message = pattern(size, sent.size());
    deviceSends(message);
    sent = joined(sent, message);
    got = joined(got, readAll(in, 1000));  // behind, and never whole messages
  }
  for (auto more = readAll(in); !more.empty(); more = readAll(in)) got = joined(got, more);
  EXPECT_EQ(got, sent);
  EXPECT_EQ(in.counters().bytes, sent.size());
}

TEST_F(Transfers, ShowsEachTransferByItself) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  deviceSends(pattern(700));
  deviceSends({});
  deviceSends(pattern(30));
  claimed_->context().handle();
  EXPECT_EQ(in.front().size(), 700U);
  in.consume(200);
  EXPECT_EQ(in.front().size(), 500U);
  in.consume(500);
  EXPECT_EQ(in.front().size(), 30U) << "an empty packet is nothing to read";
  in.consume(30);
  EXPECT_TRUE(in.front().empty());
}

TEST_F(Transfers, SlowReadingHoldsTheDeviceBackAndLosesNothing) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  std::vector<std::byte> sent;
  for (std::size_t i = 0; i < 50; ++i) {
    const auto message = pattern(10'000, sent.size());
    deviceSends(message);
    sent = joined(sent, message);
  }
  claimed_->context().handle();
  EXPECT_EQ(in.inFlight(), 0U) << "all are full, and none goes back before it was read";
  EXPECT_EQ(in.counters().transfers, 8U);
  std::vector<std::byte> got;
  for (auto more = readAll(in, 999); !more.empty(); more = readAll(in, 999)) got = joined(got, more);
  EXPECT_EQ(got, sent);
}

TEST_F(Transfers, DescriptorIsReadableExactlyWhileThereIsSomethingToRead) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  BulkIn control{*claimed_, endpoint(2), kSmall};
  claimed_->context().handle();  // libusb has news of its own after opening
  EXPECT_FALSE(readable(descriptor()));
  deviceSends(pattern(10));
  bus_->send(kPath, MockBus::kControlIn, pattern(20));
  EXPECT_TRUE(readable(descriptor()));
  EXPECT_EQ(readAll(in).size(), 10U);
  EXPECT_TRUE(readable(descriptor())) << "the other endpoint's transfer came back on the way, and was not read";
  EXPECT_EQ(readAll(control).size(), 20U);
  EXPECT_FALSE(readable(descriptor()));
}

TEST_F(Transfers, SendsEverythingInOrderAndEndsEachTransfer) {
  BulkOut out{*claimed_, endpoint(1), kSmall};
  const auto bytes = pattern(100'000);
  EXPECT_EQ(out.write(bytes), bytes.size());
  EXPECT_EQ(deviceReceived(), bytes);
  EXPECT_EQ(out.write(pattern(512)), 512U);
  claimed_->context().handle();
  EXPECT_EQ(bus_->endless(kPath), 0U) << "whole packets without an empty one would not end";
  EXPECT_EQ(out.counters().bytes, bytes.size() + 512);
}

TEST_F(Transfers, TakesNoMoreThanFitsAndTellsWhenThereIsRoomAgain) {
  BulkOut out{*claimed_, endpoint(1), {.transfers = 2, .transfer_bytes = 1024}};
  bus_->stopReading(kPath, MockBus::kDataOut);
  const auto bytes = pattern(5000);
  EXPECT_EQ(out.write(bytes), 2048U);
  EXPECT_EQ(out.write(std::span{bytes}.subspan(2048)), 0U);
  EXPECT_FALSE(readable(descriptor()));
  bus_->readAgain(kPath, MockBus::kDataOut);
  EXPECT_TRUE(readable(descriptor()));
  claimed_->context().handle();
  EXPECT_TRUE(readable(descriptor())) << "handled by somebody else, and still to be written";
  std::size_t taken = 2048;
  while (taken < bytes.size()) taken += out.write(std::span{bytes}.subspan(taken));
  claimed_->context().handle();
  EXPECT_FALSE(readable(descriptor()));
  EXPECT_EQ(deviceReceived(), bytes);
}

TEST_F(Transfers, CountsWhatTheBusSpoilsAndGoesOn) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  bus_->spoil(kPath, MockBus::kDataIn, -EPROTO);
  bus_->spoil(kPath, MockBus::kDataIn, -EOVERFLOW);
  deviceSends(pattern(100));
  claimed_->context().handle();
  EXPECT_EQ(readAll(in), pattern(100));
  EXPECT_EQ(in.counters().errors, 1U);
  EXPECT_EQ(in.counters().overflows, 1U);
  EXPECT_EQ(in.state(), EndpointState::open);
  EXPECT_EQ(in.inFlight(), 8U);
}

TEST_F(Transfers, GivesUpABusThatSpoilsEverything) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  for (int i = 0; i < 100; ++i) bus_->spoil(kPath, MockBus::kDataIn, -EPROTO);
  for (int i = 0; i < 100; ++i) claimed_->context().handle();
  EXPECT_EQ(in.state(), EndpointState::failed);
  EXPECT_LT(in.counters().errors, 50U);
}

TEST_F(Transfers, AStallEndsTheEndpointAfterWhatCameBeforeIt) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  deviceSends(pattern(100));
  bus_->spoil(kPath, MockBus::kDataIn, -EPIPE);
  claimed_->context().handle();
  EXPECT_EQ(in.state(), EndpointState::stalled);
  EXPECT_FALSE(in.over());
  EXPECT_EQ(readAll(in), pattern(100));
  EXPECT_TRUE(in.over());
  EXPECT_EQ(in.counters().stalls, 1U);
  EXPECT_TRUE(readable(descriptor())) << "the end is news, too";
}

TEST_F(Transfers, AFailedTransferEndsTheWayOut) {
  BulkOut out{*claimed_, endpoint(1), kSmall};
  bus_->spoil(kPath, MockBus::kDataOut, -EPROTO);
  out.write(pattern(100));
  claimed_->context().handle();
  EXPECT_EQ(out.state(), EndpointState::failed) << "nobody knows what has arrived";
  EXPECT_EQ(out.write(pattern(100)), 0U);
}

TEST_F(Transfers, UnplugInMidTransferKeepsWhatCameAndEndsTheRest) {
  BulkIn in{*claimed_, endpoint(0), kSmall};
  BulkOut out{*claimed_, endpoint(1), kSmall};
  deviceSends(pattern(40'000));
  bus_->stopReading(kPath, MockBus::kDataOut);
  EXPECT_EQ(out.write(pattern(100)), 100U);
  bus_->unplug(kPath);
  EXPECT_TRUE(readable(descriptor()));
  EXPECT_EQ(readAll(in), pattern(40'000));
  claimed_->context().handle();
  EXPECT_TRUE(in.over());
  EXPECT_EQ(in.state(), EndpointState::gone);
  EXPECT_EQ(out.state(), EndpointState::gone);
  EXPECT_EQ(out.write(pattern(1)), 0U);
  EXPECT_EQ(in.inFlight() + out.inFlight(), 0U);
}

TEST_F(Transfers, CancelsWhatIsInFlightAtTheEnd) {
  bus_->stopReading(kPath, MockBus::kDataOut);
  {
    BulkIn in{*claimed_, endpoint(0), kSmall};
    BulkOut out{*claimed_, endpoint(1), kSmall};
    EXPECT_EQ(out.write(pattern(100'000)), 100'000U);
    deviceSends(pattern(10));
    EXPECT_GT(bus_->inFlight(kPath, MockBus::kDataOut), 0U);
  }
  EXPECT_EQ(bus_->inFlight(kPath, MockBus::kDataIn), 0U);
  EXPECT_EQ(bus_->inFlight(kPath, MockBus::kDataOut), 0U);
  claimed_->context().handle();
  EXPECT_FALSE(readable(descriptor()));
}

// What is kept for ever keeps libusb's thread with it, which would disturb later tests: in processes of their own.
class Lasting : public Transfers {
 protected:
  void SetUp() override {
    if (IS_EMULATED_BY_PROGRAM) GTEST_SKIP() << "qemu-user starts no second program of its processor";
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    Transfers::SetUp();
  }
};

TEST_F(Lasting, MemoryOfTransfersThatNeverComeBack) {
  const auto check = [this] {
    {
      BulkIn in{*claimed_, endpoint(0), kSmall};
      bus_->freeze(kPath);
    }
    claimed_.reset();
    bus_->send(kPath, MockBus::kDataIn, pattern(100'000));  // written where they point to
    EXPECT_EQ(bus_->inFlight(kPath, MockBus::kDataIn), 1U);
    EXPECT_TRUE(bus_->claimed(kPath)) << "closing would free them";
    std::exit(HasFailure() ? 1 : 0);
  };
  EXPECT_EXIT(check(), ::testing::ExitedWithCode(0), "");
}

TEST_F(Lasting, ProcessWhenTheDeviceIsUnpluggedBeforeItsReset) {
  const auto check = [this] {
    bus_->unplug(kPath);
    while (claimed_->reset().ok()) {
    }
    EXPECT_EQ(claimed_->reset().error().kind, OpenError::Kind::gone);
    claimed_.reset();
    std::exit(HasFailure() ? 1 : 0);
  };
  EXPECT_EXIT(check(), ::testing::ExitedWithCode(0), "");
}

class UsbLink : public OnABus {
 protected:
  void open() {
    auto link = openUsbLink("PB-0001");
    ASSERT_TRUE(link.ok()) << link.error().what;
    link_ = std::move(*link);
  }
  static std::vector<std::byte> readAll(io::BytePipe& lane) {
    std::vector<std::byte> bytes(100'000);
    bytes.resize(lane.read(bytes).bytes);
    return bytes;
  }
  static bool isClosed(io::BytePipe& lane) {
    std::array<std::byte, 1> byte;
    return lane.read(byte).state == io::PipeState::closed;
  }

  io::Connection link_;
};

TEST_F(UsbLink, HasTwoLanesThatDoNotMix) {
  bus_->plug(kBox);
  open();
  EXPECT_EQ(link_.data->name(), "usb:PB-0001");
  EXPECT_FALSE(link_.data->watchedForWriting());
  EXPECT_EQ(link_.data->descriptor(), link_.control->descriptor());
  EXPECT_GE(bus_->inFlight(kPath, MockBus::kDataIn), 8U);
  EXPECT_EQ(link_.data->write(pattern(10)).bytes, 10U);
  EXPECT_EQ(link_.control->write(pattern(20)).bytes, 20U);
  EXPECT_EQ(bus_->received(kPath, MockBus::kDataOut), pattern(10));
  EXPECT_EQ(bus_->received(kPath, MockBus::kControlOut), pattern(20));
  bus_->send(kPath, MockBus::kDataIn, pattern(30));
  bus_->send(kPath, MockBus::kControlIn, pattern(40));
  EXPECT_EQ(readAll(*link_.control), pattern(40));
  EXPECT_EQ(readAll(*link_.data), pattern(30));
  EXPECT_EQ(link_.data->read({}).state, io::PipeState::open);
}

TEST_F(UsbLink, IsClosedAfterAnUnplugOnceEverythingIsRead) {
  bus_->plug(kBox);
  open();
  bus_->send(kPath, MockBus::kDataIn, pattern(3000));
  bus_->unplug(kPath);
  std::array<std::byte, 2000> some;
  EXPECT_EQ(link_.data->read(some).state, io::PipeState::open);
  EXPECT_EQ(link_.data->read(some).bytes, 1000U);
  EXPECT_EQ(link_.data->read(some).state, io::PipeState::closed);
  EXPECT_EQ(link_.control->read(some).state, io::PipeState::closed);
  EXPECT_EQ(link_.control->write(pattern(1)).state, io::PipeState::closed);
}

TEST_F(UsbLink, TellsTheBoxThatItsHostHasGone) {
  bus_->plug(kBox);
  open();
  EXPECT_EQ(bus_->resets(kPath), 1U);
  link_.data.reset();
  EXPECT_EQ(bus_->resets(kPath), 1U) << "the other lane is still there";
  link_.control.reset();
  EXPECT_EQ(bus_->resets(kPath), 2U);
  EXPECT_FALSE(bus_->claimed(kPath));
}

TEST_F(UsbLink, CanBeOpenedAgainAfterEachPlug) {
  for (std::uint8_t i = 1; i <= 10; ++i) {
    auto box = kBox;
    box.address = i;
    bus_->plug(box);
    open();
    bus_->send(kPath, MockBus::kDataIn, pattern(i));
    EXPECT_EQ(readAll(*link_.data).size(), i);
    bus_->unplug(kPath);
    EXPECT_TRUE(isClosed(*link_.data));
  }
}

TEST_F(UsbLink, RefusesADeviceWithOtherEndpoints) {
  auto odd = kBox;
  odd.endpoints = {MockBus::kDataIn, MockBus::kDataOut};
  bus_->plug(odd);
  const auto link = openUsbLink("");
  ASSERT_FALSE(link.ok());
  EXPECT_THAT(link.error().what, HasSubstr("endpoints"));
}

}  // namespace
}  // namespace probebox::usb_host
