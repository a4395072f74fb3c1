#include <gmock/gmock.h>

#include "drivers/usb_gadget/gadget_port.hpp"
#include "drivers/usb_gadget/linux_function_fs.hpp"

namespace probebox::usb_gadget {
namespace {

using testing::HasSubstr;

TEST(PortAddress, IsWhereTheSetUpPutsThingsUnlessToldOtherwise) {
  const auto usual = parsePort("");
  ASSERT_TRUE(usual.ok());
  EXPECT_EQ(usual->function_fs, "/run/probebox-usb");
  EXPECT_EQ(usual->gadget, "/sys/kernel/config/usb_gadget/probebox");
  EXPECT_EQ(usual->controller, "");
  const auto own = parsePort(":mount=/run/a,gadget=/sys/b,controller=fe980000.usb");
  ASSERT_TRUE(own.ok());
  EXPECT_EQ(own->function_fs, "/run/a");
  EXPECT_EQ(own->gadget, "/sys/b");
  EXPECT_EQ(own->controller, "fe980000.usb");
}

TEST(PortAddress, RefusesWhatItDoesNotKnow) {
  for (const auto* text : {"x", ":speed=3", ":mount", ":mount=", ":controller=a,,"}) {
    const auto port = parsePort(text);
    ASSERT_FALSE(port.ok()) << text;
    EXPECT_THAT(port.error().what, HasSubstr(std::string{"'usb"} + text + "'"));
    EXPECT_THAT(port.error().what, HasSubstr("write usb"));
  }
}

TEST(GadgetPort, SaysWhatIsMissingAndWhatToDo) {
  PortAddress nowhere;
  nowhere.function_fs = "/nonexistent/probebox-usb";
  const auto port = GadgetPort::open(nowhere);
  ASSERT_FALSE(port.ok());
  EXPECT_THAT(port.error().what, HasSubstr("/nonexistent/probebox-usb"));
  EXPECT_THAT(port.error().what, HasSubstr("probebox-usb-setup"));
  const auto bound = bindGadget("/nonexistent/gadget", "udc.0");
  ASSERT_FALSE(bound.ok());
  EXPECT_THAT(bound.error().what, HasSubstr("/nonexistent/gadget/UDC"));
}

}  // namespace
}  // namespace probebox::usb_gadget
