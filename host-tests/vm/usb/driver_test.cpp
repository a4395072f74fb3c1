#include <algorithm>
#include <array>
#include <functional>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libusb.h>
#include <memory>
#include <poll.h>
#include <random>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "box_user.hpp"
#include "drivers/usb_gadget/gadget_port.hpp"
#include "drivers/usb_host/device.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "kernel_files.hpp"
#include "usb_gadget.hpp"

// The box's end (FunctionFS) and a host's end (libusb) of one bus, in one thread: whoever has something to do is asked
// in turn.
namespace probebox::vm {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

class Bus : public testing::Test {
 protected:
  void openPort() {
    AsBoxUser unprivileged;
    ASSERT_TRUE(unprivileged.taken());
    auto opened = usb_gadget::GadgetPort::open({});
    ASSERT_TRUE(opened.ok()) << opened.error().what;
    port = std::move(*opened);
  }

  // Until `done`, or for at most ten seconds of nothing being done.
  bool turnUntil(const std::function<bool()>& done) {
    for (int idle = 0; idle < 1000;) {
      if (port) {
        port->turn();
        if (auto connection = port->accept()) box = std::move(*connection);
      }
      if (done()) return true;
      std::array<pollfd, 2> waiting{pollfd{port ? port->descriptor() : -1, POLLIN, 0},
                                    pollfd{host.data ? host.data->descriptor() : -1, POLLIN, 0}};
      idle += poll(waiting.data(), waiting.size(), 10) == 0 ? 1 : 0;
    }
    return false;
  }

  void connect() {
    ASSERT_TRUE(turnUntil([&] {
      auto opened = usb_host::openUsbLink("");
      if (opened) host = std::move(*opened);
      return opened.ok();
    }));
    box = {};
    ASSERT_TRUE(turnUntil([&] { return box.data != nullptr; }));
  }

  // Whether all of `bytes` come out at the other end as they went in, and nothing else.
  bool carried(io::BytePipe& from, io::BytePipe& to, const Bytes& bytes) {
    std::size_t written = 0;
    Bytes received;
    return turnUntil([&] {
             written += from.write(std::span{bytes}.subspan(written)).bytes;
             Bytes part(4096);
             for (std::size_t got = 1; got > 0;) {
               got = to.read(part).bytes;
               received.insert(received.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got));
             }
             return received.size() >= bytes.size();
           }) &&
           received == bytes;
  }

  // Writes until nothing has gone on for a while, which is long on a slow machine: both sides are full. Returns how
  // much that was.
  std::size_t fill(std::span<const std::byte> bytes) {
    constexpr int kStill = 100;
    std::size_t written = 0;
    int refused = 0;
    EXPECT_TRUE(turnUntil([&] {
      const auto put = box.data->write(bytes.subspan(written)).bytes;
      written += put;
      refused = put > 0 ? 0 : refused + 1;
      return refused == kStill;
    }));
    return written;
  }

  Bytes random(std::size_t size) {
    Bytes bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::byte>(numbers());
    return bytes;
  }

  UsbGadget gadget;
  std::unique_ptr<usb_gadget::GadgetPort> port;
  io::Connection host;
  io::Connection box;
  std::mt19937 numbers{7};
};

TEST_F(Bus, ShowsTheBoxByTheClassOfItsInterfaceAndItsSerialNumber) {
  openPort();
  std::vector<usb_host::Device> found;
  ASSERT_TRUE(turnUntil([&] {
    const auto context = usb_host::Context::open();
    found = usb_host::devices(*context, usb::kLink);
    return !found.empty();
  }));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].serial_number, "SIM-0001");
  EXPECT_EQ(found[0].product, "probebox");
  ASSERT_EQ(found[0].endpoints.size(), 4U);
  EXPECT_TRUE(found[0].endpoints[0].in && !found[0].endpoints[1].in && found[0].endpoints[2].in);
}

// What Windows asks for before it looks for a driver file (Microsoft OS descriptors 1.0).
TEST_F(Bus, TellsWindowsToBindItsOwnDriver) {
  openPort();
  connect();
  libusb_context* context = nullptr;
  ASSERT_EQ(libusb_init(&context), 0);
  libusb_device_handle* handle = libusb_open_device_with_vid_pid(context, 0x1209, 0x0001);
  ASSERT_NE(handle, nullptr);
  std::array<unsigned char, 256> answer{};
  const auto ask = [&](std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index) {
    answer.fill(0);
    return libusb_control_transfer(handle, type, request, value, index, answer.data(), answer.size(), 1000);
  };
  // String 0xEE: "MSFT100" and the number of the request that comes next.
  ASSERT_EQ(ask(0x80, LIBUSB_REQUEST_GET_DESCRIPTOR, 0x03EE, 0), 18);
  const std::array<unsigned char, 14> signature{'M', 0, 'S', 0, 'F', 0, 'T', 0, '1', 0, '0', 0, '0', 0};
  EXPECT_TRUE(std::equal(signature.begin(), signature.end(), answer.begin() + 2));
  const unsigned char code = answer[16];
  ASSERT_GE(ask(0xC0, code, 0, 4), 16 + 24);
  const std::string id{answer.begin() + 18, answer.begin() + 24};
  EXPECT_EQ(id, "WINUSB");
  EXPECT_EQ(answer[16], 0);  // our interface is the first
  ASSERT_GT(ask(0xC1, code, 0, 5), 10);
  std::string text;
  for (const unsigned char c : answer) {
    if (c >= ' ' && c <= '~') text += static_cast<char>(c);
  }
  EXPECT_THAT(text, HasSubstr("DeviceInterfaceGUID"));
  EXPECT_THAT(text, HasSubstr("{8b0d1e4c-6f7a-4d52-9a31-70e2c5b1f001}"));
  // A request that nobody knows is stalled, and nothing hangs.
  auto stalled = std::async(std::launch::async, [&] { return ask(0xC1, 0x77, 0, 0); });
  EXPECT_TRUE(turnUntil([&] { return port->counters().stalled_requests == 1; }));
  EXPECT_EQ(stalled.get(), LIBUSB_ERROR_PIPE);
  libusb_close(handle);
  libusb_exit(context);
}

TEST_F(Bus, CarriesEveryByteInOrderBothWaysOnBothLanes) {
  openPort();
  connect();
  for (const std::size_t size : {1U, 63U, 64U, 65U, 511U, 512U, 513U, 1024U, 4096U, 16384U, 16385U, 300'000U}) {
    const auto bytes = random(size);
    EXPECT_TRUE(carried(*box.data, *host.data, bytes)) << size;
    EXPECT_TRUE(carried(*host.data, *box.data, bytes)) << size;
    EXPECT_TRUE(carried(*box.control, *host.control, bytes)) << size;
    EXPECT_TRUE(carried(*host.control, *box.control, bytes)) << size;
  }
  EXPECT_EQ(port->counters().discarded_bytes, 0U);
  EXPECT_EQ(port->counters().failed_transfers, 0U);
}

// What the host left unread, and what it wrote last, must not reach whoever comes next.
TEST_F(Bus, GivesTheNextHostACleanStart) {
  openPort();
  connect();
  const auto flood = random(4'000'000);  // more than a host takes into its transfers
  // Whether the host's last word has come in by then is a matter of luck.
  for (int k = 0; k < 3 || (k < 30 && port->counters().discarded_bytes == 0); ++k) {
    fill(flood);
    host.control->write(random(1000));
    host = {};
    connect();
    EXPECT_TRUE(carried(*box.data, *host.data, random(100'000)));
    EXPECT_TRUE(carried(*host.control, *box.control, random(10'000)));
  }
  EXPECT_GE(port->counters().connections, 4U);
  EXPECT_GT(port->counters().discarded_bytes, 0U);
}

TEST_F(Bus, ALaneThatNobodyReadsStopsAloneAndWithoutWaiting) {
  openPort();
  connect();
  const auto flood = random(4'000'000);
  std::size_t written = fill(flood);
  EXPECT_LT(written, 1'000'000U);  // what is in flight on both sides
  EXPECT_TRUE(carried(*box.control, *host.control, random(50'000)));
  Bytes received;
  EXPECT_TRUE(turnUntil([&] {
    written += box.data->write(std::span{flood}.subspan(written)).bytes;
    Bytes part(65536);
    const auto got = host.data->read(part).bytes;
    received.insert(received.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got));
    return received.size() == flood.size();
  }));
  EXPECT_EQ(received, flood);
}

TEST_F(Bus, SeesAnUnbindInMidTransferAndTheComingBack) {
  openPort();
  connect();
  box.data->write(random(100'000));
  gadget.unbind();
  std::byte byte{};
  EXPECT_TRUE(turnUntil([&] { return box.data->read({&byte, 1}).state == io::PipeState::closed; }));
  EXPECT_EQ(box.control->write({&byte, 1}).state, io::PipeState::closed);
  Bytes rest(65536);
  EXPECT_TRUE(turnUntil([&] { return host.data->read(rest).state == io::PipeState::closed; }));
  host = {};
  gadget.bind();
  connect();
  EXPECT_TRUE(carried(*box.data, *host.data, random(100'000)));
}

TEST_F(Bus, SeesAHostThatWasKilledAndServesTheNext) {
  openPort();
  connect();
  host = {};
  const pid_t child = fork();
  if (child == 0) {
    auto opened = usb_host::openUsbLink("");
    if (opened) opened->data->write(Bytes(3000));
    while (true) pause();
  }
  box = {};
  ASSERT_TRUE(turnUntil([&] { return box.data != nullptr; }));
  std::size_t received = 0;
  EXPECT_TRUE(turnUntil([&] {
    Bytes part(4096);
    received += box.data->read(part).bytes;
    return received == 3000;
  }));
  box.data->write(random(100'000));
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  box.data->write(random(100'000));
  connect();
  EXPECT_TRUE(carried(*box.data, *host.data, random(100'000)));
  EXPECT_TRUE(carried(*host.data, *box.data, random(100'000)));
}

TEST_F(Bus, SeesTheHostTakeItsConfigurationAway) {
  openPort();
  connect();
  host = {};
  const std::string device = "/sys/bus/usb/devices/1-1";
  writeTo(device + "/bConfigurationValue", "0");
  std::byte byte{};
  EXPECT_TRUE(turnUntil([&] { return box.data->read({&byte, 1}).state == io::PipeState::closed; }));
  writeTo(device + "/bConfigurationValue", "1");
  connect();
  EXPECT_TRUE(carried(*box.data, *host.data, random(10'000)));
}

TEST_F(Bus, CountsASleepingBusAndGoesOnAfterIt) {
  openPort();
  connect();
  host = {};
  const std::string power = "/sys/bus/usb/devices/1-1/power";
  writeTo(power + "/autosuspend_delay_ms", "0");
  writeTo(power + "/control", "auto");
  EXPECT_TRUE(turnUntil([&] { return port->counters().suspensions > 0; }));
  writeTo(power + "/control", "on");
  connect();
  EXPECT_TRUE(carried(*box.data, *host.data, random(100'000)));
}

TEST_F(Bus, LeavesWithThePortAndComesBackWithTheNext) {
  openPort();
  connect();
  port.reset();
  box = {};
  EXPECT_EQ(gadget.boundTo(), "");
  Bytes rest(65536);
  EXPECT_TRUE(turnUntil([&] { return host.data->read(rest).state == io::PipeState::closed; }));
  host = {};
  openPort();
  connect();
  EXPECT_TRUE(carried(*box.data, *host.data, random(10'000)));
}

TEST_F(Bus, SaysWhyAPortCannotBeHad) {
  openPort();
  const auto second = usb_gadget::GadgetPort::open({});
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().what, HasSubstr("/run/probebox-usb/ep0 is held by another process"));
  port.reset();
  usb_gadget::PortAddress elsewhere;
  elsewhere.controller = "no-such-udc";
  const auto nowhere = usb_gadget::GadgetPort::open(elsewhere);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_THAT(nowhere.error().what, HasSubstr("no-such-udc"));
}

}  // namespace
}  // namespace probebox::vm
