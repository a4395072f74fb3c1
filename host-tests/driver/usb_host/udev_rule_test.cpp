// The rule that gives boxes to people; host-tests/vm/usb_host shows it at work.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <sstream>
#include <string>

#include "protocol/usb/interface.hpp"

namespace probebox::usb {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kRule = PROBEBOX_UDEV_RULE;

// As udev writes it in ID_USB_INTERFACES.
std::string pattern(const InterfaceClass& wanted) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "*:%02x%02x%02x:*", unsigned{wanted.interface_class},
                unsigned{wanted.subclass}, unsigned{wanted.protocol});
  return text.data();
}

TEST(UdevRule, ComesBeforeAccessIsGivenOut) {
  EXPECT_LT(std::stoi(kRule.filename()), 73);
}

TEST(UdevRule, GoesByTheClassesOfTheInterfaces) {
  std::ostringstream text;
  text << std::ifstream{kRule}.rdbuf();
  for (const auto& wanted : {kLink, kReceiver}) {
    EXPECT_THAT(text.str(), HasSubstr("ENV{ID_USB_INTERFACES}==\"" + pattern(wanted) + "\", TAG+=\"uaccess\""));
  }
}

TEST(UdevRule, IsOneThatUdevUnderstands) {
  if (std::system("udevadm verify --help >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "this udevadm cannot verify rules (systemd 254 can)";
  }
  EXPECT_EQ(std::system(("udevadm verify --resolve-names=never " + kRule.string()).c_str()), 0);
}

}  // namespace
}  // namespace probebox::usb
