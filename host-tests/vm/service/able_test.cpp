#include <chrono>
#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <vector>

#include "host-tests/host/test_host.hpp"
#include "receiver_gadget.hpp"
#include "running_service.hpp"

// The installed service under systemd with all that it is forbidden: it can still do what it must.
namespace probebox::vm {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using support::TestHost;
using testing::HasSubstr;
using testing::Not;

TEST_F(Service, IsStartedByTheFirstHostThatKnocks) {
  shell("systemctl stop probeboxd.service");
  ASSERT_EQ(InstalledBox::property("ActiveState"), "inactive");
  const auto host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  EXPECT_EQ(host->ask<messages::Status>().board, "vm");
  EXPECT_EQ(InstalledBox::property("ActiveState"), "active");
  EXPECT_THAT(InstalledBox::property("StatusText"), HasSubstr("Master clock"));
}

TEST_F(Service, RunsAsItsOwnUserWithoutAnyPrivilege) {
  const auto status = proc() / "status";
  EXPECT_NE(box.uid(), 0U);
  const auto uid = std::to_string(box.uid());
  EXPECT_EQ(field(status, "Uid"), uid + "\t" + uid + "\t" + uid + "\t" + uid);
  for (const auto* set : {"CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"})
    EXPECT_EQ(field(status, set), "0000000000000000") << set;
  EXPECT_EQ(field(status, "NoNewPrivs"), "1");
  EXPECT_EQ(field(status, "Seccomp"), "2");
}

TEST_F(Service, HasRealTimeAndAllItsMemory) {
  EXPECT_EQ(sched_getscheduler(std::stoi(threadFolder("capture").filename())), SCHED_FIFO);
  EXPECT_EQ(sched_getscheduler(std::stoi(threadFolder("core").filename())), SCHED_OTHER);
  const auto kilobytes = [&](const char* name) { return std::stol(field(proc() / "status", name)); };
  std::printf("resident %ld kB, locked %ld kB\n", kilobytes("VmRSS"), kilobytes("VmLck"));
  EXPECT_GT(kilobytes("VmLck"), kilobytes("VmRSS") / 2);
  EXPECT_LT(kilobytes("VmRSS"), 48 * 1024);
  EXPECT_EQ(kilobytes("VmSwap"), 0);
  // Neither was said to be missing.
  EXPECT_THAT(InstalledBox::log(), Not(HasSubstr("(allow it with")));
}

TEST_F(Service, ReadsItsLines) {
  const auto host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  const auto sync = [&] {
    const auto lines = host->ask<messages::Status>().lines;
    return lines.empty() ? messages::LineStatus{} : lines.front();
  };
  // It takes a line that was not there at its start within seconds.
  ASSERT_TRUE(host->eventually([&] {
    box.lines.pulse(0);
    return sync().edges > 0;
  })) << InstalledBox::log();
  host->linger(500ms);
  const auto before = sync();
  for (int i = 0; i < 1000; ++i) {
    box.lines.pulse(0);
    host->linger(1ms);
  }
  EXPECT_TRUE(host->eventually([&] { return sync().edges == before.edges + 1000; })) << sync().edges;
  EXPECT_EQ(sync().lost, before.lost);
}

TEST_F(Service, IsADeviceOnUsb) {
  ASSERT_TRUE(eventually([] { return readFrom("/sys/kernel/config/usb_gadget/probebox/UDC") == "dummy_udc.0"; }))
      << InstalledBox::log();
  const auto host = TestHost::connect("usb:VM-0001");
  ASSERT_TRUE(host);
  EXPECT_EQ(host->ask<messages::Status>().board, "vm");
}

TEST_F(Service, AnswersTheControllerOverUsb) {
  ASSERT_TRUE(eventually([] { return fs::exists("/dev/ttyACM0"); }));
  const auto poll =
      "timeout 20 mbpoll -m rtu -a 1 -b 19200 -P none -0 -1 -o 2 -r 2 -c 1 -t 4:hex /dev/ttyACM0 2>&1 || true";
  std::string said;
  for (int tries = 0; tries < 10 && said.find("[2]:") == std::string::npos; ++tries) said = shell(poll);
  EXPECT_THAT(said, HasSubstr("[2]:"));
  const auto host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  const auto lines = host->ask<messages::Status>().cnc_lines;
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].name, "/dev/ttyGS0");
  EXPECT_GT(lines[0].answered, 0U);
}

TEST_F(Service, ReadsAProbeReceiverThatIsPluggedInLater) {
  const auto host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  ASSERT_EQ(host->ask<messages::Status>().receiver.samples, 0U);
  const ReceiverGadget gadget;
  const ReceiverPlayer player{{"--rate", "2000", "--samples", "8"}};
  // Nothing gives it to the box but the udev rule.
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Status>().receiver.samples > 1000; }));
}

TEST_F(Service, IsFoundByEverybodyOnTheBox) {
  EXPECT_THAT(shell("setpriv --reuid=65534 --clear-groups probebox list"), HasSubstr("127.0.0.1:7627"));
}

TEST_F(Service, KeepsWhatWasAcceptedWhenItIsKilled) {
  shell("systemctl stop probeboxd.service");
  const auto id = box.propose();
  shell("systemctl start probeboxd.service");
  auto host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  host->ask<messages::AcceptResult>({.id = id, .by = "somebody"});
  const auto killed = InstalledBox::pid();
  ASSERT_EQ(kill(killed, SIGKILL), 0);  // at once after the acknowledgement
  ASSERT_TRUE(replaced(killed));
  host = TestHost::connect(kConnection);
  ASSERT_TRUE(host);
  // It waits until the box has seen that no cut is on.
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Status>().active_results == std::vector{id}; }));
  EXPECT_EQ(fs::status("/var/lib/probebox").permissions() & fs::perms::others_all, fs::perms::none);
}

}  // namespace
}  // namespace probebox::vm
