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

TEST_F(Service, IsStartedAgainWhenItIsStopped) {
  const auto stopped = InstalledBox::pid();
  const auto restarts = InstalledBox::restarts();
  ASSERT_EQ(kill(stopped, SIGSTOP), 0);
  ASSERT_TRUE(replaced(stopped));
  EXPECT_EQ(InstalledBox::restarts(), restarts + 1);
  EXPECT_TRUE(TestHost::connect(kDoor));
}

TEST_F(Service, IsStartedAgainWhenOneOfItsStagesStandsStill) {
  const auto stalled = InstalledBox::pid();
  const auto held = support::HeldThread::hold(stalled, "core");
  ASSERT_TRUE(held) << held.error().what;
  ASSERT_TRUE(replaced(stalled));
  EXPECT_THAT(InstalledBox::log(), HasSubstr("Stages not progressing, the first is the cause: core"));
  EXPECT_TRUE(TestHost::connect(kDoor));
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
  shell("sed -i /nonsense/d /etc/probebox/box.toml && systemctl reset-failed probeboxd.service");
}

}  // namespace
}  // namespace probebox::vm
