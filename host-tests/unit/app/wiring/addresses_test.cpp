#include "firmware/app/wiring/addresses.hpp"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "drivers/serial/emulator.hpp"
#include "host-tests/support/temporary_folder.hpp"

// Where hosts and controllers come in, checked before anything is opened.
namespace probebox::app {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Addresses : public testing::Test {
 protected:
  // What is wrong with a service.toml; empty when nothing is.
  static std::string problemOf(const std::string& text, const Options& options = {}) {
    const auto service = board::parseService(text, "service.toml");
    EXPECT_TRUE(service) << (service ? "" : service.error().what);
    if (!service) return "";
    const auto refused = whyNoAddresses(options, *service);
    return refused ? refused->what : "";
  }

  const support::TemporaryFolder folder_;
};

TEST_F(Addresses, OfSerialLinesNeverLeadToFiles) {
  std::ofstream{folder_.file("file")} << "text";
  std::filesystem::create_symlink(folder_.file("file"), folder_.file("ttyS1"));
  EXPECT_EQ(
      problemOf("links = [\"serial:/etc/passwd\"]\ncnc = [\n  \"modbus:" + folder_.file("ttyS1") + "\"]\n"),
      "service.toml:1: 'links': /etc/passwd: this is an ordinary file, no serial line; name a terminal device such "
      "as /dev/ttyS1\n"
      "service.toml:3: 'cnc': " +
          folder_.file("ttyS1") +
          ": this is an ordinary file, no serial line; name a terminal device such as /dev/ttyS1");
  EXPECT_THAT(problemOf("links = [\"serial:ttyS1\"]"), AllOf(HasSubstr("'ttyS1'"), HasSubstr("/dev/ttyS1")));
  EXPECT_EQ(problemOf("links = [\"serial:" + folder_.file("not there yet") + "\"]"), "");
}

// Under its name the box keeps whether the controller declares a cut.
TEST_F(Addresses, OfSerialLinesAreShortEnoughToKeepAnInhibitUnder) {
  const std::string by_id = "/dev/serial/by-id/usb-" + std::string(101, 'x');
  for (const std::string kind : {"modbus", "records", "tape"})
    EXPECT_THAT(
        problemOf("cnc = [\"" + kind + ":" + by_id + "\"]"),
        AllOf(HasSubstr("service.toml:1: 'cnc': '" + by_id), HasSubstr("up to " + std::to_string(79 - kind.size())),
              HasSubstr("has 123"), HasSubstr("SYMLINK")));
  EXPECT_THAT(problemOf("\nlinks = [\"serial:" + by_id + "\"]"), HasSubstr("service.toml:2: 'links': '" + by_id));
  EXPECT_EQ(problemOf("cnc = [\"modbus:/dev/" + std::string(68, 'x') + ",baud=9600,parity=none\"]"), "");
  EXPECT_THAT(problemOf("cnc = [\"modbus:/dev/" + std::string(69, 'x') + "\"]"), HasSubstr("SYMLINK"));
  Options options;
  options.cnc = {"modbus:" + by_id};
  EXPECT_THAT(problemOf("", options), HasSubstr("--cnc: '" + by_id));
}

TEST_F(Addresses, NameEachDeviceOnce) {
  const auto cable = serial::EmulatedCable::open(folder_.file("a"), folder_.file("b"));
  ASSERT_TRUE(cable) << cable.error().what;
  std::filesystem::create_symlink(folder_.file("a"), folder_.file("also a"));
  EXPECT_EQ(problemOf("cnc = [\"modbus:" + folder_.file("a") + "\", \"modbus:" + folder_.file("b") + "\"]"), "");
  EXPECT_THAT(
      problemOf("links = [\"serial:" + folder_.file("a") + "\"]\ncnc = [\"modbus:" + folder_.file("also a") +
                ",unit=2\"]\n"),
      AllOf(HasSubstr("service.toml:2: 'cnc': " + folder_.file("also a")), HasSubstr("service.toml:1: 'links'")));
  EXPECT_THAT(problemOf("cnc = [\"modbus:/dev/ttyS71,unit=1\", \"modbus:/dev/ttyS71,unit=2\"]"),
              AllOf(HasSubstr("/dev/ttyS71"), HasSubstr("service.toml:1"), HasSubstr("'cnc'")));
  EXPECT_THAT(problemOf("links = [\"tcp:127.0.0.1:7627\", \"tcp::7627\"]"),
              AllOf(HasSubstr("tcp:127.0.0.1:7627"), HasSubstr("in use")));
  EXPECT_THAT(problemOf("links = [\"usb\", \"usb:controller=dummy\"]"), HasSubstr("USB port"));
}

// Two listeners of which the second cannot bind: the start failed for ever, and blamed another process.
TEST_F(Addresses, OfOnePortDoNotOverlap) {
  for (const char* const second : {"localhost", "0.0.0.0", "[::]"}) {
    const std::string address = "\"tcp:" + std::string{second} + ":7627\"";
    EXPECT_THAT(problemOf("links = [\"tcp:127.0.0.1:7627\", " + address + "]\n[[connection]]\naddress = " + address +
                          "\nread_only = true\n"),
                AllOf(HasSubstr(std::string{second} + ":7627"), HasSubstr("service.toml:1: 'links'")))
        << second;
  }
  EXPECT_THAT(problemOf("links = [\"tcp:localhost:502\"]\ncnc = [\"modbus-tcp:127.0.0.1:502\"]"),
              AllOf(HasSubstr("tcp:127.0.0.1:502"), HasSubstr("service.toml:1"), HasSubstr("'links'")));
  EXPECT_EQ(problemOf("links = [\"tcp:127.0.0.1:7627\", \"tcp:127.0.0.2:7627\", \"tcp:localhost:7628\"]"), "");
}

TEST_F(Addresses, HaveEachSettingOnce) {
  EXPECT_THAT(problemOf("cnc = [\"modbus:/dev/ttyS71,unit=1,baud=9600,unit=2\"]"),
              AllOf(HasSubstr("service.toml:1: 'cnc': 'modbus:/dev/ttyS71,unit=1,baud=9600,unit=2'"),
                    HasSubstr("'unit='"), HasSubstr("twice")));
  EXPECT_THAT(problemOf("links = [\"serial:/dev/ttyS71,baud=9600,baud=19200\"]"),
              AllOf(HasSubstr("'baud='"), HasSubstr("twice")));
  EXPECT_THAT(problemOf("cnc = [\"tape:/dev/ttyS71,dialect=nv,dialect=g10\"]"),
              AllOf(HasSubstr("'dialect='"), HasSubstr("twice")));
  EXPECT_THAT(problemOf("cnc = [\"modbus-tcp:127.0.0.1:502,words=low-first,words=high-first\"]"),
              AllOf(HasSubstr("'words='"), HasSubstr("twice")));
}

TEST_F(Addresses, HaveSettingsThatLinesHave) {
  EXPECT_THAT(problemOf("cnc = [\"modbus:/dev/ttyS1,baud=19201\"]"),
              AllOf(HasSubstr("service.toml:1"), HasSubstr("'cnc'"), HasSubstr("/dev/ttyS1"), HasSubstr("19201"),
                    HasSubstr("baud=19200?")));
  EXPECT_THAT(problemOf("cnc = [\"modbus:/dev/ttyS1,unit=248\"]"), AllOf(HasSubstr("unit=1"), HasSubstr("unit=247")));
  EXPECT_THAT(problemOf("links = [\"tcp:127.0.0.1:70000\"]"), HasSubstr("TCP address"));
}

TEST_F(Addresses, LetNobodyFromElsewhereDoMoreThanRead) {
  for (const char* const host : {"0.0.0.0", "[::]", "192.168.0.7", "box.local"}) {
    const std::string address = "\"tcp:" + std::string{host} + ":7627\"";
    const std::string links = "links = [" + address + "]\n";
    EXPECT_THAT(problemOf(links), AllOf(HasSubstr("service.toml:1: 'links': The link tcp:" + std::string{host} +
                                                  ":7627 can be reached from other computers"),
                                        HasSubstr("ssh -L"), HasSubstr("read_only = true")));
    EXPECT_THAT(problemOf(links + "[[connection]]\naddress = " + address + "\n"), HasSubstr("read_only = true"));
    EXPECT_EQ(problemOf(links + "[[connection]]\naddress = " + address + "\nread_only = true\n"), "");
  }
  for (const char* const host : {"127.0.0.1", "localhost", "[::1]", ""})
    EXPECT_EQ(problemOf("links = [\"tcp:" + std::string{host} + ":7627\"]\n[access]\nallow_accept = true\n"), "")
        << host;
  Options options;
  options.links = {"tcp:0.0.0.0:7627"};
  EXPECT_THAT(problemOf("", options), AllOf(HasSubstr("--link"), HasSubstr("tcp:0.0.0.0:7627")));
}

TEST_F(Addresses, OfACncOnTheNetworkAreForReadingWhereOthersReachThem) {
  EXPECT_EQ(problemOf("cnc = [\"modbus-tcp:127.0.0.1:502,words=low-first\"]"), "");
  EXPECT_THAT(problemOf("cnc = [\"modbus-tcp:0.0.0.0:502\"]"),
              AllOf(HasSubstr("service.toml:1"), HasSubstr("'cnc'"), HasSubstr("modbus-tcp:0.0.0.0:502"),
                    HasSubstr("\"modbus-tcp:0.0.0.0:502\""), HasSubstr("read_only = true")));
  EXPECT_EQ(problemOf("cnc = [\"modbus-tcp:0.0.0.0:502\"]\n"
                      "[[connection]]\naddress = \"modbus-tcp:0.0.0.0:502\"\nread_only = true\n"),
            "");
  EXPECT_THAT(problemOf("links = [\"tcp:127.0.0.1:502\"]\ncnc = [\"modbus-tcp:127.0.0.1:502\"]"),
              AllOf(HasSubstr("tcp:127.0.0.1:502"), HasSubstr("service.toml:1"), HasSubstr("'links'")));
  EXPECT_THAT(problemOf("cnc = [\"modbus-tcp:127.0.0.1:502,words=big\"]"), HasSubstr("words=high-first"));
}

TEST(ConnectionOfAListener, HasTheNameOfItsLinkAtEveryStart) {
  const tcp::Address everywhere{.host = "0.0.0.0", .port = 7627}, chosen{.host = "127.0.0.1", .port = 40123};
  const std::vector<std::string> links{"usb", "tcp:127.0.0.1:7627", "tcp:127.0.0.1:0"};
  EXPECT_EQ(connectionNameOf("tcp", linkAt(everywhere, links), everywhere), "tcp:127.0.0.1:7627")
      << "systemd opened it";
  EXPECT_EQ(connectionNameOf("tcp", linkAt(chosen, links), chosen), "tcp:127.0.0.1:40123")
      << "of the socket unit alone";
  EXPECT_EQ(connectionNameOf("tcp", {.host = "127.0.0.1", .port = 0}, chosen), "tcp:127.0.0.1:0");
  EXPECT_EQ(connectionNameOf("tcp", {.host = std::string(200, 'x'), .port = 7627}, chosen), "tcp:127.0.0.1:40123");
  EXPECT_EQ(connectionNameOf("tls", everywhere, everywhere), "tls:0.0.0.0:7627");
}

// A socket that systemd opened for persons is not served as one for everybody, nor the other way round.
TEST(ConnectionOfAListener, IsTheOneThatItsLinkNames) {
  const tcp::Address everywhere{.host = "0.0.0.0", .port = 7628}, other{.host = "0.0.0.0", .port = 7627};
  const std::vector<std::string> links{"tcp:127.0.0.1:7627", "tls:10.0.0.7:7628"};
  const auto door = tlsLinkAt(everywhere, links);
  ASSERT_TRUE(door);
  EXPECT_EQ(tcp::describe(*door), "10.0.0.7:7628");
  EXPECT_FALSE(tlsLinkAt(other, links));
  EXPECT_FALSE(tlsLinkAt({.host = "127.0.0.1", .port = 7628}, links));
}

TEST_F(Addresses, OfTlsMayBeReachedByOthersAndNeedKeysAndAPortOfTheirOwn) {
  constexpr const char* kKeys = "[tls]\ncertificate = \"/c\"\nkey = \"/k\"\npeople_ca = \"/p\"\n";
  EXPECT_EQ(problemOf(std::string{"links = [\"tls:0.0.0.0:7628\"]\n"} + kKeys), "");
  EXPECT_THAT(problemOf(std::string{"links = [\"tls:0.0.0.0:7627\", \"tcp:127.0.0.1:7627\"]\n"} + kKeys),
              HasSubstr("tcp:127.0.0.1:7627"));
  Options options;
  options.links = {"tls:0.0.0.0:7628"};
  EXPECT_THAT(problemOf("links = []", options), AllOf(HasSubstr("--link"), HasSubstr("[tls]")));
  EXPECT_EQ(problemOf(kKeys, options), "");
  options.links = {"tls:7628"};
  EXPECT_THAT(problemOf(kKeys, options), HasSubstr("HOST:PORT"));
}

TEST_F(Addresses, OfTheCommandLineStandInForThoseOfTheFile) {
  Options options;
  options.links = {"tcp:127.0.0.1:1"};
  options.cnc = {"modbus:/dev/null", "punch:/dev/ttyS1", "tape:/dev/ttyS2,dialect=iso"};
  const auto problem = problemOf("links = [\"serial:/etc/passwd\"]", options);
  EXPECT_THAT(problem, AllOf(HasSubstr("--cnc"), HasSubstr("/dev/null"), HasSubstr("another device"),
                             HasSubstr("\n--cnc"), HasSubstr("'punch:/dev/ttyS1'"), HasSubstr("'dialect=iso'"),
                             HasSubstr("dialect=g10|macro|nv"), Not(HasSubstr("passwd"))));
}

}  // namespace
}  // namespace probebox::app
