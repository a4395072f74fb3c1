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

TEST(Uri, UsbIsNotInThisBuildAndSaysSo) {
  const auto usb = parseUri("usb:PB-0001");
  ASSERT_FALSE(usb.ok());
  EXPECT_NE(usb.error().what.find("not in this build yet"), std::string::npos);
}

TEST(Uri, ARecordingCannotBeConnectedTo) {
  const auto pipe = open(*parseUri("file:REC.pbx"), std::chrono::milliseconds{1});
  ASSERT_FALSE(pipe.ok());
  EXPECT_NE(pipe.error().what.find("recording"), std::string::npos);
}

}  // namespace
}  // namespace probebox::link
