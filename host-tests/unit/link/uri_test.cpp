#include "tools/link/uri.hpp"

#include <gtest/gtest.h>

namespace probebox::link {
namespace {

TEST(Uri, NamesABoxOrARecording) {
  const auto tcp = parseUri("tcp:localhost:7627");
  ASSERT_TRUE(tcp.ok());
  EXPECT_EQ(std::get<tcp::Address>(tcp->address).host, "localhost");
  EXPECT_EQ(std::get<tcp::Address>(tcp->address).port, 7627);

  const auto serial = parseUri("serial:/dev/ttyUSB0,baud=115200");
  ASSERT_TRUE(serial.ok());
  EXPECT_EQ(std::get<serial::Address>(serial->address).path, "/dev/ttyUSB0");
  EXPECT_EQ(std::get<serial::Address>(serial->address).settings.baud, 115200U);

  const auto file = parseUri("file:REC.pbx");
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(file->isFile());
  EXPECT_EQ(std::get<FileAddress>(file->address).path, "REC.pbx");
}

TEST(Uri, ThatIsNoneSaysWhatOneLooksLike) {
  for (const auto* text : {"", "localhost", "http://box", "tcp:", "tcp:host", "tcp:host:port", "tcp:host:99999",
                           "serial:", "serial:/dev/x,baud=fast", "file:"}) {
    const auto uri = parseUri(text);
    ASSERT_FALSE(uri.ok()) << text;
    EXPECT_FALSE(uri.error().what.empty());
  }
}

TEST(Uri, NamesABoxOnUsbOrTheOnlyOne) {
  const auto nameIn = [](std::string_view text) { return std::get<UsbAddress>(parseUri(text)->address).name; };
  EXPECT_EQ(nameIn("usb:PB-0001"), "PB-0001");
  EXPECT_EQ(nameIn("usb:1-1.4"), "1-1.4");
  EXPECT_EQ(nameIn("usb:A:B"), "A:B") << "a serial number is whatever the vendor wrote";
  EXPECT_EQ(nameIn("usb"), "");
  EXPECT_EQ(nameIn("usb:"), "");
  EXPECT_FALSE(parseUri("usbPB-0001").ok());
}

TEST(Uri, OfASlowLineSuitsProfileTight) {
  messages::Descriptor box;  // 1000 samples a second
  const auto suitable = [&](std::string_view text) { return suitableProfile(*parseUri(text), box); };
  EXPECT_EQ(suitable("serial:/dev/ttyUSB0"), messages::Profile::tight);
  EXPECT_EQ(suitable("serial:/dev/ttyUSB0,baud=115200"), messages::Profile::tight);
  EXPECT_EQ(suitable("serial:/dev/ttyUSB0,baud=3000000"), messages::Profile::fast);
  EXPECT_EQ(suitable("tcp:box:7627"), messages::Profile::fast);
  EXPECT_EQ(suitable("usb"), messages::Profile::fast);
  box.samples_per_tick = 100;
  EXPECT_EQ(suitable("serial:/dev/ttyUSB0"), messages::Profile::fast) << "a quick box does not send tight";
}

TEST(Uri, ThatNamesItsBoxIsSettled) {
  for (const auto* text : {"usb:PB-0001", "tcp:localhost:7627"}) EXPECT_EQ(settled(*parseUri(text))->text, text);
}

TEST(Uri, ARecordingCannotBeConnectedTo) {
  const auto pipe = open(*parseUri("file:REC.pbx"), std::chrono::milliseconds{1});
  ASSERT_FALSE(pipe.ok());
  EXPECT_NE(pipe.error().what.find("recording"), std::string::npos);
}

}  // namespace
}  // namespace probebox::link
