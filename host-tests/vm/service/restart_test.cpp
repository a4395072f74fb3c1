#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "host-tests/host/test_host.hpp"
#include "host-tests/support/held_thread.hpp"
#include "running_service.hpp"

// When systemd starts the service again, and when it does not.
namespace probebox::vm {
namespace {

namespace fs = std::filesystem;
using support::TestHost;
using testing::HasSubstr;

// Each start that refuses the key says so once.
std::size_t timesRefused() {
  const auto log = InstalledBox::log();
  std::size_t times = 0;
  for (auto at = log.find("nonsense"); at != std::string::npos; at = log.find("nonsense", at + 1)) ++times;
  return times;
}

TEST_F(Service, IsStartedAgainWhenItIsStopped) {
  const auto stopped = InstalledBox::pid();
  const auto restarts = InstalledBox::restarts();
  ASSERT_EQ(kill(stopped, SIGSTOP), 0);
  ASSERT_TRUE(replaced(stopped));
  EXPECT_EQ(InstalledBox::restarts(), restarts + 1);
  EXPECT_TRUE(TestHost::connect(kConnection));
}

TEST_F(Service, IsStartedAgainWhenOneOfItsStagesStandsStill) {
  const auto stalled = InstalledBox::pid();
  const auto held = support::HeldThread::hold(stalled, "core");
  ASSERT_TRUE(held) << held.error().what;
  ASSERT_TRUE(replaced(stalled));
  EXPECT_THAT(InstalledBox::log(), HasSubstr("Stages not progressing, the first is the cause: core"));
  EXPECT_TRUE(TestHost::connect(kConnection));
}

TEST_F(Service, EndsInOrderAndLeavesNothing) {
  shell("systemctl stop probeboxd.service");
  EXPECT_EQ(InstalledBox::property("Result"), "success");
  EXPECT_FALSE(fs::exists("/run/probebox"));
  shell("systemctl stop probebox-usb.service");
  EXPECT_FALSE(fs::exists("/sys/kernel/config/usb_gadget/probebox"));
  EXPECT_FALSE(fs::exists("/run/probebox-usb"));
}

TEST_F(Service, IsNotStartedAgainForDescriptionsThatCannotBeRead) {
  shell("systemctl stop probeboxd.service probeboxd.socket && echo 'nonsense = 1' >>/etc/probebox/box.toml");
  shell("systemctl start probeboxd.service || true");
  EXPECT_EQ(InstalledBox::property("ActiveState"), "failed");
  EXPECT_EQ(InstalledBox::property("ExecMainStatus"), "2");
  EXPECT_THAT(InstalledBox::log(), HasSubstr("nonsense"));
  // A host that comes to see what is wrong starts it once more, and not for ever.
  const auto refusals = timesRefused();
  shell("timeout 5 bash -c 'exec 3<>/dev/tcp/127.0.0.1/7627' || true");
  std::this_thread::sleep_for(std::chrono::seconds{20});
  EXPECT_LE(timesRefused(), refusals + 2);
  shell("sed -i /nonsense/d /etc/probebox/box.toml && systemctl reset-failed probeboxd.service");
}

}  // namespace
}  // namespace probebox::vm
