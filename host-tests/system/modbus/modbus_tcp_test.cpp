#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "firmware/app/cnc/modbus_tcp_server.hpp"
#include "fixture.hpp"

namespace probebox::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::byte> bytesOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

// The server at a port of this computer, masters at connections.
class NetworkMaster : public ServedRegisters {
 protected:
  void SetUp() override {
    ServedRegisters::SetUp();
    if (IsSkipped()) return;
    startServer(true);
  }
  void TearDown() override { stopServer(); }

  void startServer(bool words_chosen_by_masters) {
    stopServer();
    auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    ASSERT_TRUE(listener) << listener.error().what;
    address_ = listener->address();
    auto of_this = callbacks();
    if (!words_chosen_by_masters) of_this.registers.keep = nullptr;
    server_ = std::make_unique<ModbusTcpServer>(std::move(*listener), "1.2.3", std::move(of_this));
    thread_ = std::jthread{[this] { server_->run(); }};
  }
  void stopServer() {
    if (server_) server_->stop();
    thread_ = {};
  }

  std::string poll(const std::string& options, const std::string& values = "", const std::string& unit = "1") {
    return ask("-m tcp -a " + unit + " -p " + std::to_string(address_.port) + " -o 5 " + options, address_.host,
               values);
  }

  std::unique_ptr<io::BytePipe> connect() const {
    auto pipe = tcp::connectTcp(address_, std::chrono::seconds{10});
    EXPECT_TRUE(pipe) << (pipe ? "" : pipe.error().what);
    return pipe ? std::move(*pipe) : nullptr;
  }
  // From another address of this computer.
  io::Descriptor connectFrom(const char* host) const {
    io::Descriptor socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    sockaddr_in from{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {inet_addr(host)}, .sin_zero = {}};
    EXPECT_EQ(bind(socket.get(), reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
    from.sin_addr.s_addr = inet_addr("127.0.0.1");
    from.sin_port = htons(address_.port);
    EXPECT_EQ(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
    return socket;
  }
  // What comes until there are `count` bytes or the connection ends.
  static std::string received(io::BytePipe& pipe, std::size_t count) {
    std::string all;
    EXPECT_TRUE(eventually([&] {
      std::array<char, 512> buffer{};
      const auto got = pipe.read(std::as_writable_bytes(std::span{buffer}));
      all.append(buffer.data(), got.bytes);
      return all.size() >= count || got.state == io::PipeState::closed;
    }));
    return all;
  }
  static bool isClosed(io::BytePipe& pipe) { return received(pipe, SIZE_MAX).empty(); }

  tcp::Address address_;
  std::unique_ptr<ModbusTcpServer> server_;

 private:
  std::jthread thread_;
};

published::Snapshot xOf(double x_mm) {
  published::Snapshot snapshot;
  snapshot.valid = true;
  snapshot.correction_mm = {x_mm, 0, 0};
  return snapshot;
}

// "Read register 5", as MODBUS Messaging on TCP/IP writes it.
constexpr std::string_view kReadX{"\x12\x34\0\0\0\x06\x11\x03\0\x05\0\x01", 12};
constexpr std::string_view kAnswerX{"\x12\x34\0\0\0\x05\x11\x03\x02\xFF\x83", 11};  // -125

TEST_F(NetworkMaster, ReadsCorrectionsWhateverUnitItNames) {
  show(xOf(-0.0125));
  for (const auto* const unit : {"1", "17", "255"})
    EXPECT_THAT(poll("-r 5 -c 1 -t 4", "", unit), HasSubstr("[5]: \t65411 (-125)")) << unit;
  EXPECT_EQ(server_->counters().answered, 3U);
}

TEST_F(NetworkMaster, IsAnsweredWithItsOwnTransactionAndUnit) {
  show(xOf(-0.0125));
  const auto pipe = connect();
  ASSERT_TRUE(pipe);
  pipe->write(bytesOf(kReadX));
  EXPECT_EQ(received(*pipe, kAnswerX.size()), kAnswerX);
  // Two at once, the second in two parts.
  pipe->write(bytesOf(std::string{kReadX} + std::string{kReadX.substr(0, 7)}));
  EXPECT_EQ(received(*pipe, kAnswerX.size()), kAnswerX);
  pipe->write(bytesOf(kReadX.substr(7)));
  EXPECT_EQ(received(*pipe, kAnswerX.size()), kAnswerX);
}

TEST_F(NetworkMaster, IsToldWhatItMayNotDo) {
  EXPECT_THAT(poll("-r " + std::to_string(modbus::kRegisterCount - 2) + " -c 3 -t 4"),
              HasSubstr("Illegal data address"));
  EXPECT_THAT(poll("-r 5 -t 4", "1"), HasSubstr("Illegal data address"));
  EXPECT_THAT(poll("-r 0 -c 1 -t 0"), HasSubstr("Illegal function"));
  markers_allowed_ = false;
  EXPECT_THAT(poll("-r 157 -t 4", "1"), HasSubstr("Illegal data value"));
  EXPECT_THAT(markers(), IsEmpty());
  EXPECT_TRUE(eventually([&] { return server_->counters().refused == 4; }));
}

TEST_F(NetworkMaster, IsToldThatItsRequestIsShorterOrLongerThanItsFunction) {
  show(xOf(-0.0125));
  const auto pipe = connect();
  ASSERT_TRUE(pipe);
  const std::array<std::string, 4> bad{
      std::string{"\0\1\0\0\0\x05\x01\x03\0\x05\0", 11}, std::string{"\0\1\0\0\0\x07\x01\x03\0\x05\0\x01\0", 13},
      std::string{"\0\1\0\0\0\x09\x01\x10\0\x90\0\x02\x04\0\1", 15}, std::string{"\0\1\0\0\0\x05\x01\x06\0\x80\0", 11}};
  for (const auto& request : bad) {
    pipe->write(bytesOf(request));
    auto expected = std::string{"\0\1\0\0\0\x03\x01", 7} + static_cast<char>(request[7] | '\x80') + '\x03';
    EXPECT_EQ(received(*pipe, expected.size()), expected);
  }
  pipe->write(bytesOf(kReadX));
  EXPECT_EQ(received(*pipe, kAnswerX.size()), kAnswerX);
}

TEST_F(NetworkMaster, SendsAMarkerOnceAlthoughItComesBackAndRepeatsTheRequest) {
  const std::string marker = "0 7 3 1 250 2 1 24464 0 0 0 0 1 41";
  EXPECT_THAT(poll("-r 144 -t 4", marker), HasSubstr("Written 14 references"));
  EXPECT_THAT(poll("-r 144 -t 4", marker), HasSubstr("Written 14 references"));
  ASSERT_EQ(markers().size(), 1U);
  EXPECT_EQ(markers()[0].procedure, 7U);
}

TEST_F(NetworkMaster, CannotChangeTheWordOrderOfTheOthers) {
  startServer(false);
  show(xOf(-0.5));
  EXPECT_THAT(poll("-r 128 -t 4", "1"), HasSubstr("Illegal data value"));
  EXPECT_THAT(poll("-r 128 -t 4", "0"), HasSubstr("Written 1 references")) << "as it is already";
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int -B"), HasSubstr("[32]: \t-500000"));
}

TEST_F(NetworkMaster, IsToldWhoAnswers) {
  const auto pipe = connect();
  ASSERT_TRUE(pipe);
  pipe->write(bytesOf({"\0\x09\0\0\0\x05\x01\x2B\x0E\x01\0", 11}));
  const std::string answer = received(*pipe, 52);
  EXPECT_THAT(answer, AllOf(HasSubstr("probebox"), HasSubstr("probe interface box"), HasSubstr("1.2.3")));
  EXPECT_EQ(answer.substr(0, 4), std::string("\0\x09\0\0", 4));
  EXPECT_EQ(static_cast<std::size_t>(static_cast<unsigned char>(answer[5])) + 6, answer.size()) << "no CRC behind it";
}

TEST_F(NetworkMaster, DoesNotSufferFromABrowserThatIsTurnedOut) {
  show(xOf(-0.0125));
  const auto browser = connect();
  ASSERT_TRUE(browser);
  browser->write(bytesOf("POST / HTTP/1.1\r\nHost: box\r\n\r\n" + std::string{kReadX}));
  EXPECT_TRUE(isClosed(*browser));
  EXPECT_THAT(reports(), HasSubstr("Modbus"));
  EXPECT_THAT(poll("-r 5 -c 1 -t 4"), HasSubstr("(-125)"));
  EXPECT_TRUE(eventually([&] { return server_->counters().answered == 1; }));
  EXPECT_EQ(server_->counters().bad_frames, 1U);
  EXPECT_EQ(server_->counters().skipped_bytes, 30 + kReadX.size());
}

TEST_F(NetworkMaster, ThatGoesInTheMiddleOfARequestIsCounted) {
  auto gone = connect();
  ASSERT_TRUE(gone);
  gone->write(bytesOf(std::string{kReadX} + std::string{kReadX.substr(0, 7)}));
  EXPECT_EQ(received(*gone, kAnswerX.size()).size(), kAnswerX.size());
  gone.reset();
  EXPECT_TRUE(eventually([&] { return server_->counters().skipped_bytes == 7; }));
  EXPECT_EQ(server_->counters().bad_frames, 1U);
}

TEST_F(NetworkMaster, KeepsItsPlaceWhileItAsksAndOthersAreSilent) {
  show(xOf(-0.0125));
  const auto controller = connect();
  ASSERT_TRUE(controller);
  std::vector<std::unique_ptr<io::BytePipe>> silent;
  for (std::size_t k = 0; k < 3 * ModbusTcpServer::kMostMasters; ++k) {
    silent.push_back(connect());
    controller->write(bytesOf(kReadX));
    EXPECT_EQ(received(*controller, kAnswerX.size()), kAnswerX);
  }
  EXPECT_TRUE(isClosed(*silent.front()));
  EXPECT_THAT(reports(), HasSubstr("newer"));
}

TEST_F(NetworkMaster, KeepsItsPlaceHoweverManyKnockBetweenTwoOfItsRequests) {
  show(xOf(-0.0125));
  const auto controller = connect();
  ASSERT_TRUE(controller);
  std::vector<std::unique_ptr<io::BytePipe>> knocking;
  for (int round = 0; round < 3; ++round) {
    controller->write(bytesOf(kReadX));
    EXPECT_EQ(received(*controller, kAnswerX.size()), kAnswerX);
    for (std::size_t k = 0; k < 2 * ModbusTcpServer::kMostMasters; ++k) knocking.push_back(connect());
    EXPECT_TRUE(isClosed(*knocking.at(knocking.size() - ModbusTcpServer::kMostMasters)));
  }
}

// The control asks seldom, as seen by a program that asks without end.
TEST_F(NetworkMaster, KeepsItsPlaceHoweverManyOfAnotherComputerAsk) {
  show(xOf(-0.0125));
  const auto controller = connectFrom("127.0.0.2");
  const auto asks = [&] {
    std::string all(kAnswerX.size(), '\0');
    return send(controller.get(), kReadX.data(), kReadX.size(), MSG_NOSIGNAL) > 0 &&
           recv(controller.get(), all.data(), all.size(), MSG_WAITALL) > 0 && all == kAnswerX;
  };
  ASSERT_TRUE(asks());
  std::vector<std::unique_ptr<io::BytePipe>> others;
  for (std::size_t k = 0; k < 3 * ModbusTcpServer::kMostMasters; ++k) {
    others.push_back(connect());
    others.back()->write(bytesOf(kReadX));
    EXPECT_EQ(received(*others.back(), kAnswerX.size()), kAnswerX);
  }
  EXPECT_TRUE(isClosed(*others.front()));
  EXPECT_TRUE(asks());
}

TEST_F(NetworkMaster, IsTurnedOutWhenItDoesNotReadItsAnswers) {
  show(xOf(-0.0125));
  const auto deaf = connect();
  ASSERT_TRUE(deaf);
  // 125 registers each.
  const auto read = bytesOf({"\0\1\0\0\0\x06\x01\x03\0\0\0\x7D", 12});
  EXPECT_TRUE(eventually([&] {
    for (int k = 0; k < 1000; ++k) deaf->write(read);
    return server_->counters().unsent == 1;
  }));
  EXPECT_THAT(reports(), HasSubstr("its answers"));
  EXPECT_THAT(poll("-r 5 -c 1 -t 4"), HasSubstr("(-125)"));
}

TEST(ModbusTcpOptions, AreReadOrRefusedByName) {
  const auto usual = parseModbusTcpOptions("127.0.0.1:502");
  ASSERT_TRUE(usual);
  EXPECT_EQ(tcp::describe(usual->address), "127.0.0.1:502");
  EXPECT_EQ(usual->words, modbus::WordOrder::high_first);
  EXPECT_EQ(parseModbusTcpOptions("[::1]:502,words=low-first")->words, modbus::WordOrder::low_first);
  for (const auto* const bad : {"127.0.0.1:502,words=big", "127.0.0.1:502,", "127.0.0.1:502,unit=1"}) {
    const auto outcome = parseModbusTcpOptions(bad);
    ASSERT_FALSE(outcome) << bad;
    EXPECT_THAT(outcome.error().what, testing::AllOf(HasSubstr("words=high-first"), HasSubstr("words=low-first")));
  }
  EXPECT_FALSE(parseModbusTcpOptions("127.0.0.1"));
}

}  // namespace
}  // namespace probebox::app
