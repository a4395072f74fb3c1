#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <optional>
#include <sys/stat.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "drivers/serial/emulator.hpp"
#include "drivers/serial/linux_serial.hpp"
#include "drivers/serial/transceiver.hpp"

namespace probebox::serial {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using End = EmulatedCable::End;
using Bytes = std::vector<std::byte>;
constexpr std::chrono::milliseconds kPatience{20};

Bytes bytes(std::string_view text) {
  Bytes all;
  for (const char c : text) all.push_back(static_cast<std::byte>(c));
  return all;
}

class SerialLine : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    auto cable = EmulatedCable::open(folder_ / "a", folder_ / "b");
    ASSERT_TRUE(cable.ok()) << cable.error().what;
    cable_.emplace(std::move(cable).value());
  }
  void TearDown() override {
    cable_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::unique_ptr<io::BytePipe> open(const std::string& port, const Settings& settings = {}) {
    auto pipe = openSerial((folder_ / port).string(), settings);
    EXPECT_TRUE(pipe.ok()) << (pipe.ok() ? "" : pipe.error().what);
    return pipe.ok() ? std::move(pipe).value() : nullptr;
  }
  std::string refusal(const std::string& port, const Settings& settings = {}) {
    const auto pipe = openSerial((folder_ / port).string(), settings);
    EXPECT_FALSE(pipe.ok());
    return pipe.ok() ? "" : pipe.error().what;
  }

  // Reads until `count` bytes are there or the cable has nothing more for a while.
  Bytes receive(io::BytePipe& pipe, std::size_t count) {
    Bytes all;
    for (int idle = 0; all.size() < count && idle < 200;) {
      std::array<std::byte, 4096> buffer{};
      const auto moved = cable_->pump(kPatience);
      const auto got = pipe.read(buffer);
      all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
      idle = moved + got.bytes > 0 ? 0 : idle + 1;
    }
    return all;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path{::testing::TempDir()} / ("probebox-serial-" + std::to_string(getpid()));
  std::optional<EmulatedCable> cable_;
};

TEST_F(SerialLine, CarriesEveryByteUnchangedInBothDirections) {
  const auto a = open("a");
  const auto b = open("b", {460'800, Parity::even, 8, 2});
  ASSERT_TRUE(a && b);
  Bytes all;
  for (int value = 0; value < 256; ++value) all.push_back(static_cast<std::byte>(value));
  EXPECT_EQ(a->write(all).bytes, all.size());
  EXPECT_EQ(receive(*b, all.size()), all);
  EXPECT_EQ(b->write(all).bytes, all.size());
  EXPECT_EQ(receive(*a, all.size()), all);
}

TEST_F(SerialLine, HasRatesUpToThreeMegabaud) {
  if (IS_EMULATED_BY_PROGRAM) GTEST_SKIP() << "qemu-user knows rates up to 460 800 baud";
  EXPECT_TRUE(openSerial((folder_ / "b").string(), {.baud = 3'000'000}).ok());
}

TEST_F(SerialLine, DoesNotWaitForBytesThatAreNotThere) {
  const auto a = open("a");
  std::array<std::byte, 16> buffer{};
  const auto nothing = a->read(buffer);
  EXPECT_EQ(nothing.bytes, 0U);
  EXPECT_EQ(nothing.state, io::PipeState::open);
}

TEST_F(SerialLine, SaysHowMuchItTookWhenNobodyReads) {
  const auto a = open("a");
  const Bytes block(4096, std::byte{'x'});
  std::size_t taken = 0;
  for (int i = 0; i < 100; ++i) {
    const auto written = a->write(block);
    EXPECT_EQ(written.state, io::PipeState::open);
    taken += written.bytes;
  }
  EXPECT_LT(taken, 100 * block.size());
  const auto b = open("b");
  EXPECT_EQ(receive(*b, taken).size(), taken);
}

TEST_F(SerialLine, BelongsToOneProcessAtATime) {
  auto first = open("a");
  EXPECT_THAT(refusal("a"), HasSubstr("another process"));
  first.reset();
  EXPECT_NE(open("a"), nullptr);
}

TEST_F(SerialLine, IsFreeAgainAfterItsOwnerWasKilled) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const auto owner = fork();
  if (owner == 0) {
    const auto line = openSerial((folder_ / "a").string(), {});
    const char state = line.ok() ? 'y' : 'n';
    [[maybe_unused]] const auto told = write(ready[1], &state, 1);
    for (;;) pause();
  }
  char state = 0;
  ASSERT_EQ(read(ready[0], &state, 1), 1);
  EXPECT_EQ(state, 'y');
  EXPECT_THAT(refusal("a"), HasSubstr("another process"));
  kill(owner, SIGKILL);
  waitpid(owner, nullptr, 0);
  EXPECT_NE(open("a"), nullptr);
  close(ready[0]);
  close(ready[1]);
}

TEST_F(SerialLine, SeesAPulledAdapterAsClosedAndOpensAgainUnderTheSameName) {
  auto a = open("a");
  cable_->unplug(End::a);
  std::array<std::byte, 16> buffer{};
  EXPECT_EQ(a->read(buffer).state, io::PipeState::closed);
  EXPECT_EQ(a->write(buffer).state, io::PipeState::closed);
  EXPECT_THAT(refusal("a"), HasSubstr("no such"));

  ASSERT_TRUE(cable_->plug(End::a).ok());
  a = open("a");
  const auto b = open("b");
  b->write(bytes("back"));
  EXPECT_EQ(receive(*a, 4), bytes("back"));
}

TEST_F(SerialLine, KeepsBytesDuringAStallAndShowsNoiseThatNobodySent) {
  const auto a = open("a");
  const auto b = open("b");
  cable_->stall(true);
  a->write(bytes("late"));
  EXPECT_EQ(cable_->pump(kPatience), 0U);
  cable_->inject(End::b, bytes("#!"));
  cable_->stall(false);
  EXPECT_EQ(receive(*b, 6), bytes("#!late"));
}

TEST_F(SerialLine, IsRefusedWithARemedy) {
  EXPECT_THAT(refusal("a", {12345, Parity::none, 8, 1}), HasSubstr("12345"));
  EXPECT_THAT(refusal("nothing"), HasSubstr("cable"));
  std::ofstream{folder_ / "file"} << "text";
  EXPECT_THAT(refusal("file"), HasSubstr("ordinary file"));
}

TEST_F(SerialLine, IsToldFromEverythingElseWithoutOpeningIt) {
  std::ofstream{folder_ / "file"} << "text";
  std::filesystem::create_symlink(folder_ / "file", folder_ / "link to a file");
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);  // would wait for ever where somebody opened it
  for (const auto& [path, kind] :
       {std::pair{(folder_ / "file").string(), "an ordinary file"},
        std::pair{(folder_ / "link to a file").string(), "an ordinary file"},
        std::pair{(folder_ / "pipe").string(), "a pipe"}, std::pair{folder_.string(), "a folder"},
        std::pair{std::string{"/dev/null"}, "another device"}, std::pair{std::string{"/dev/tty"}, "another device"},
        std::pair{std::string{"/dev/ptmx"}, "another device"}}) {
    const auto refused = whyNoLine(path);
    ASSERT_TRUE(refused) << path;
    EXPECT_THAT(refused->what, HasSubstr(path + ": this is " + kind + ", no serial line; name a terminal device"));
    EXPECT_FALSE(openSerial(path, {}).ok());
  }
  EXPECT_FALSE(whyNoLine((folder_ / "a").string())) << "the emulated cable";
  EXPECT_FALSE(whyNoLine((folder_ / "nothing").string())) << "it may be plugged in later";
}

TEST(SerialAddress, TakesWhatIsNamedAndTheUsualForTheRest) {
  const auto address = parseAddress("/dev/ttyUSB0,baud=9600,stop=2", {19200, Parity::even, 8, 1});
  ASSERT_TRUE(address.ok());
  EXPECT_EQ(address->path, "/dev/ttyUSB0");
  EXPECT_EQ(describe(address->settings), "9600 8E2");
  EXPECT_EQ(describe(parseAddress("/dev/x,data=7,parity=odd")->settings), "115200 7O1");
}

TEST_F(SerialLine, TurnsATransceiverOnlyByWhatThereIs) {
  EXPECT_THAT(refusal("a", {.rs485 = {.by = Turning::kernel}}), HasSubstr("rs485=kernel"));
  EXPECT_THAT(refusal("a", {.rs485 = {.by = Turning::rts}}), HasSubstr("rs485=rts")) << "a pseudo terminal has none";
  EXPECT_THAT(refusal("a", {.rs485 = {.by = Turning::gpio, .gpio = "no such line"}}),
              AllOf(HasSubstr("rs485=gpio"), HasSubstr("no such line"), Not(HasSubstr("RTS"))));
  EXPECT_TRUE(open("a"));
}

TEST_F(SerialLine, LowersRtsAtItsEndOnlyWhereThatListens) {
  const auto lowers = [this] {
    const io::Descriptor line{::open((folder_ / "a").c_str(), O_RDWR | O_NOCTTY)};
    termios format{};
    EXPECT_EQ(tcgetattr(line.get(), &format), 0);
    return (format.c_cflag & HUPCL) != 0;
  };
  // A pseudo terminal has no RTS, and is refused when its format is set.
  refusal("a", {.rs485 = {.by = Turning::rts}});
  EXPECT_TRUE(lowers());
  refusal("a", {.rs485 = {.by = Turning::rts, .active_high = false}});
  EXPECT_FALSE(lowers());
}

Rs485 rs485Of(const std::string& settings) {
  const auto address = parseAddress("/dev/x," + settings);
  EXPECT_TRUE(address.ok()) << settings;
  return address.ok() ? address->settings.rs485 : Rs485{};
}

TEST(Rs485Settings, SayWhoTurnsHowAndWhen) {
  EXPECT_EQ(rs485Of("rs485=kernel"), (Rs485{.by = Turning::kernel}));
  EXPECT_EQ(rs485Of("rs485=none"), Rs485{});
  EXPECT_EQ(rs485Of("rs485=rts,rs485_active=low,rs485_before_ms=1,rs485_after_ms=100"),
            (Rs485{.by = Turning::rts, .active_high = false, .before_ms = 1, .after_ms = 100}));
  EXPECT_EQ(rs485Of("rs485=gpio:gpiochip0/18,baud=9600"), (Rs485{.by = Turning::gpio, .gpio = "gpiochip0/18"}));
  for (const auto* const bad : {"rs485=", "rs485=gpio", "rs485=gpio:", "rs485=yes", "rs485=rts,rs485_before_ms=101",
                                "rs485=rts,rs485_after_ms=-1", "rs485=rts,rs485_active=1", "rs485_after_ms=1",
                                "rs485_active=low", "rs485=none,rs485_before_ms=2"})
    EXPECT_FALSE(parseAddress(std::string{"/dev/x,"} + bad).ok()) << bad;
}

TEST(Rs485Settings, OfAHostMayNotBeTurnedByTheProgram) {
  EXPECT_FALSE(whyNoHostLink(*parseAddress("/dev/x")));
  EXPECT_FALSE(whyNoHostLink(*parseAddress("/dev/x,rs485=kernel"))) << "four wires may need it";
  EXPECT_TRUE(whyNoHostLink(*parseAddress("/dev/x,rs485=rts")));
  EXPECT_TRUE(whyNoHostLink(*parseAddress("/dev/x,rs485=gpio:DE")));
}

TEST(Rs485Settings, AreWhatTheKernelIsAskedFor) {
  const auto plain = kernelRequest({.by = Turning::kernel});
  EXPECT_EQ(plain.flags, SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND);
  EXPECT_EQ(plain.delay_rts_before_send, 0U);
  EXPECT_EQ(plain.delay_rts_after_send, 0U);
  const auto late = kernelRequest({.by = Turning::kernel, .active_high = false, .before_ms = 3, .after_ms = 7});
  EXPECT_EQ(late.flags, SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND);
  EXPECT_EQ(late.delay_rts_before_send, 3U);
  EXPECT_EQ(late.delay_rts_after_send, 7U);

  const auto line = gpioRequest(18, {.by = Turning::gpio});
  EXPECT_EQ(line.offsets[0], 18U);
  EXPECT_EQ(line.num_lines, 1U);
  EXPECT_EQ(line.config.flags, GPIO_V2_LINE_FLAG_OUTPUT);
  EXPECT_EQ(line.config.num_attrs, 0U) << "inactive: it listens";
  const auto low = gpioRequest(0, {.by = Turning::gpio, .active_high = false});
  EXPECT_EQ(low.config.flags, GPIO_V2_LINE_FLAG_OUTPUT | GPIO_V2_LINE_FLAG_ACTIVE_LOW);
}

// A line that takes `most` bytes at a time, and a transceiver; both write what happens into one list.
struct TurnedLine : io::BytePipe {
  TurnedLine(std::vector<std::string>& events, std::size_t most) : events_{events}, most_{most} {}
  io::Transfer read(std::span<std::byte>) override { return {}; }
  io::Transfer write(std::span<const std::byte> from) override {
    const auto bytes = std::min(most_, from.size());
    events_.push_back("write " + std::to_string(bytes));
    return {bytes, most_ == 0 ? io::PipeState::closed : io::PipeState::open};
  }
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "line"; }
  std::vector<std::string>& events_;
  std::size_t most_;
};
struct TurnedBy : Transceiver {
  TurnedBy(std::vector<std::string>& events, bool works = true) : events_{events}, works_{works} {}
  bool turn(bool sending) override {
    events_.push_back(sending ? "send" : "listen");
    return works_;
  }
  void drain() override { events_.push_back("drain"); }
  std::vector<std::string>& events_;
  bool works_;
};

TEST(TurnedPipe, SendsAllBetweenTurningAndTurningBack) {
  std::vector<std::string> events;
  const Settings settings{
      .baud = 19200, .parity = Parity::even, .rs485 = {.by = Turning::rts, .before_ms = 2, .after_ms = 3}};
  const auto pipe = turnedPipe(std::make_unique<TurnedLine>(events, 6), std::make_unique<TurnedBy>(events), settings);
  const auto begin = std::chrono::steady_clock::now();
  const auto sent = pipe->write(bytes("ten bytes."));
  const auto lasted = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(sent.bytes, 10U);
  EXPECT_EQ(sent.state, io::PipeState::open);
  EXPECT_EQ(events, (std::vector<std::string>{"send", "write 6", "write 4", "drain", "listen"}));
  // 10 characters of 11 bits, and both delays: an adapter on USB may say at once that all is sent.
  EXPECT_GE(lasted, std::chrono::microseconds{5000 + 10 * 11 * 1'000'000 / 19200});
}

TEST(TurnedPipe, ListensAgainWhereTheLineIsGone) {
  std::vector<std::string> events;
  const Settings settings{.rs485 = {.by = Turning::rts}};
  const auto gone = turnedPipe(std::make_unique<TurnedLine>(events, 0), std::make_unique<TurnedBy>(events), settings);
  EXPECT_EQ(gone->write(bytes("x")).state, io::PipeState::closed);
  EXPECT_EQ(events.back(), "listen");
  events.clear();
  const auto unturned =
      turnedPipe(std::make_unique<TurnedLine>(events, 6), std::make_unique<TurnedBy>(events, false), settings);
  EXPECT_EQ(unturned->write(bytes("x")).state, io::PipeState::closed);
  EXPECT_EQ(events, (std::vector<std::string>{"send"})) << "nothing is sent by a transceiver that listens";
}

TEST(SerialAddress, RefusesASettingThatALineDoesNotHave) {
  for (const auto* const bad : {"/dev/x,baud", "/dev/x,baud=", "/dev/x,baud=9600x", "/dev/x,parity=mark",
                                "/dev/x,data=9", "/dev/x,stop=3", "/dev/x,speed=1", "/dev/x,,baud=9600"}) {
    const auto address = parseAddress(bad);
    ASSERT_FALSE(address.ok()) << bad;
    EXPECT_THAT(address.error().what, HasSubstr("baud=RATE"));
  }
  for (const auto& [given, nearest] : {std::pair{"19201", "19200"}, std::pair{"0", "1200"},
                                       std::pair{"110000", "115200"}, std::pair{"4294967295", "4000000"}})
    EXPECT_THAT(parseAddress(std::string{"/dev/x,baud="} + given).error().what,
                HasSubstr(std::string{given} + " baud is not a standard rate: did you mean baud=" + nearest + "?"));
  for (const unsigned rate : kRates) EXPECT_TRUE(parseAddress("/dev/x,baud=" + std::to_string(rate)).ok()) << rate;
  EXPECT_THAT(parseAddress(",baud=9600").error().what, HasSubstr("device"));
}

}  // namespace
}  // namespace probebox::serial
