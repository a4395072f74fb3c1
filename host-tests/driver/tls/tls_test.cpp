#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <optional>
#include <poll.h>
#include <random>
#include <sys/stat.h>
#include <thread>

#include "drivers/tcp/linux_tcp.hpp"
#include "drivers/tls/connection.hpp"
#include "host-tests/keys/raw_client.hpp"
#include "host-tests/keys/shop.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::tls {
namespace {

using namespace std::chrono_literals;
using support::RawClient;
using support::Shop;
using support::Wanted;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Bytes = std::vector<std::byte>;
using Pipe = std::unique_ptr<io::BytePipe>;

Bytes bytesOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

Bytes randomBytes(std::size_t count) {
  std::mt19937 random{5};
  Bytes all(count);
  for (auto& byte : all) byte = static_cast<std::byte>(random());
  return all;
}

// What poll(2) says of the descriptor: the loops of box and host know nothing else.
bool isReadable(const io::BytePipe& pipe, std::chrono::milliseconds patience) {
  pollfd wait{pipe.descriptor(), POLLIN, 0};
  return poll(&wait, 1, static_cast<int>(patience.count())) == 1;
}

class TlsConnection : public ::testing::Test {
 protected:
  static Context context(Side side, const KeyFiles& files, std::vector<std::string> shut_out = {}) {
    auto loaded = Context::load(side, files, std::move(shut_out));
    EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().what);
    return std::move(loaded).value();
  }
  // Both ends of a connection of TCP: the host's, the box's.
  std::pair<Pipe, Pipe> carriers() {
    auto host = tcp::connectTcp(listener_.address(), 5s);
    EXPECT_TRUE(host);
    Pipe box;
    while (!box) box = listener_.accept();
    return {std::move(*host), std::move(box)};
  }
  // The box's end of one that has just come, and the host's carrier.
  std::pair<Pipe, Pipe> accepted(std::vector<std::string> shut_out = {}) {
    auto [host, box] = carriers();
    auto pipe = accept(context(Side::box, shop_.box(), std::move(shut_out)), std::move(box));
    EXPECT_TRUE(pipe);
    return {std::move(host), std::move(*pipe)};
  }
  // Shakes hands in a thread of the host's, while the box reads in this one.
  Outcome<Pipe> connected(const KeyFiles& files, Pipe carrier, io::BytePipe& box,
                          const std::string& name = "localhost") {
    std::optional<Outcome<Pipe>> host;
    std::jthread shaking{[&] { host = connect(context(Side::host, files), std::move(carrier), name, 20s); }};
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (box.read(buffer_).state == io::PipeState::open && !box.person() && std::chrono::steady_clock::now() < end)
      isReadable(box, 10ms);
    shaking.join();
    return std::move(*host);
  }
  std::pair<Pipe, Pipe> goodPair() {
    auto [carrier, box] = accepted();
    auto host = connected(shop_.person("Ada"), std::move(carrier), *box);
    EXPECT_TRUE(host) << (host ? "" : host.error().what);
    return {std::move(*host), std::move(box)};
  }
  // Reads until the end, or until nothing comes for long.
  bool ends(io::BytePipe& pipe) {
    for (int k = 0; k < 200; ++k) {
      if (pipe.read(buffer_).state == io::PipeState::closed) return true;
      isReadable(pipe, 50ms);
    }
    return false;
  }

  const support::TemporaryFolder folder_;
  Shop shop_{folder_.path() / "shop"};
  tcp::Listener listener_{std::move(tcp::Listener::open({"127.0.0.1", 0})).value()};
  std::array<std::byte, 4096> buffer_{};
};

TEST_F(TlsConnection, CarriesBytesBothWaysAndKnowsWhoIsThere) {
  const auto [host, box] = goodPair();
  EXPECT_EQ(box->person(), "Ada");
  EXPECT_EQ(host->person(), "PB-1");
  EXPECT_THAT(std::string{box->name()}, ::testing::StartsWith("tls:127.0.0.1:"));
  const auto all = randomBytes(300'000);
  for (const auto& [from, to] : {std::pair{host.get(), box.get()}, std::pair{box.get(), host.get()}}) {
    std::span<const std::byte> rest{all};
    Bytes received;
    // Small reads: decrypted bytes wait inside, where the kernel does not know of them.
    std::array<std::byte, 1000> part{};
    while (received.size() < all.size()) {
      rest = rest.subspan(from->write(rest).bytes);
      ASSERT_TRUE(isReadable(*to, 5s)) << "after " << received.size();
      const auto got = to->read(part);
      received.insert(received.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    }
    EXPECT_EQ(received, all);
    EXPECT_FALSE(isReadable(*to, 0ms)) << "nothing waits, and the loop would turn for nothing";
  }
}

TEST_F(TlsConnection, ResumesNothing) {
  auto [carrier, box] = accepted();
  const auto files = shop_.person("Ada");
  RawClient client{*carrier, RawClient::with(files)};
  for (int k = 0; k < 1000 && !box->person(); ++k) {
    client.step();
    box->read(buffer_);
  }
  ASSERT_TRUE(box->person());
  box->write(bytesOf("hello"));
  client.step();
  EXPECT_EQ(SSL_version(client.get()), TLS1_3_VERSION);
  EXPECT_EQ(SSL_SESSION_is_resumable(SSL_get0_session(client.get())), 0);
}

struct Refused {
  const char* what;
  std::function<KeyFiles(Shop&)> files;
  const char* box_says;
  const char* host_says;
};

TEST_F(TlsConnection, RefusesWhoeverIsNoPersonOfTheShopAndTellsThem) {
  Shop stranger{folder_.path() / "stranger"};
  const auto of_stranger = [&](Shop& own) {
    auto files = stranger.person("Eve");
    files.trusted = own.ca();  // she trusts the box all the same
    return files;
  };
  const auto named = [](const std::string& name) {
    return [name](Shop& own) { return own.make("other", {.name = name}); };
  };
  const std::array refused{
      Refused{"other CA", of_stranger, "no trusted CA", "does not know the CA"},
      Refused{"a box's", [](Shop& own) { return own.make("x", {.name = "PB-2", .usage = "serverAuth"}); },
              "not one of a person", "not one of a person"},
      Refused{"a line break", named("Ada\nBob"), "names nobody", "a name that prints"},
      Refused{"blank", named("  "), "names nobody", "a name that prints"},
      Refused{"turns the direction", named("Ada\u202Eadb"), "names nobody", "a name that prints"},
      Refused{"no name", [](Shop& own) { return own.make("x", {}); }, "names nobody", "a name that prints"},
      Refused{"two names", [](Shop& own) { return own.make("x", {.name = "Ada", .more_names = {"Bob"}}); },
              "names nobody", "a name that prints"}};
  for (const auto& [what, files, box_says, host_says] : refused) {
    auto [carrier, box] = accepted();
    auto host = connected(files(shop_), std::move(carrier), *box);
    ASSERT_TRUE(host) << what << ": of TLS 1.3 the host's handshake is over before the box has seen its certificate";
    EXPECT_TRUE(ends(*box)) << what;
    EXPECT_FALSE(box->person()) << what;
    EXPECT_THAT(std::string{box->whyClosed()}, HasSubstr(box_says)) << what;
    EXPECT_TRUE(ends(**host)) << what;
    EXPECT_THAT(std::string{(*host)->whyClosed()}, AllOf(HasSubstr(host_says), HasSubstr("probebox-keys"))) << what;
  }
}

TEST_F(TlsConnection, RefusesExpiredCertificates) {
  auto [carrier, box] = accepted();
  const auto old = shop_.make("old", {.name = "Ada", .first_day = -20, .last_day = -10});
  RawClient client{*carrier, RawClient::with(old)};
  for (int k = 0; k < 1000 && box->read(buffer_).state == io::PipeState::open; ++k) client.step();
  EXPECT_THAT(std::string{box->whyClosed()}, HasSubstr("expired"));
  EXPECT_FALSE(box->person());
}

// Who is in when his certificate expires is let go then.
TEST_F(TlsConnection, EndsWithTheCertificateOfThePeer) {
  auto [carrier, box] = accepted();
  auto host = connected(shop_.make("soon", {.name = "Ada", .last_day = 0, .last_second = 4}), std::move(carrier), *box);
  ASSERT_TRUE(host);
  EXPECT_EQ(box->person(), "Ada");
  EXPECT_TRUE(ends(*box));
  EXPECT_THAT(std::string{box->whyClosed()}, AllOf(HasSubstr("Ada"), HasSubstr("expired")));
}

TEST_F(TlsConnection, ShutsOutACertificateThatIsLostAndNoOtherOfThatPerson) {
  const auto lost = shop_.person("Ada");
  auto [carrier, box] = accepted({Shop::fingerprint(lost)});
  auto host = connected(lost, std::move(carrier), *box);
  EXPECT_TRUE(ends(*box));
  EXPECT_THAT(std::string{box->whyClosed()}, HasSubstr("shut out"));
  ASSERT_TRUE(host);
  EXPECT_TRUE(ends(**host));
  EXPECT_THAT(std::string{(*host)->whyClosed()}, HasSubstr("shut out"));

  auto [next_carrier, next_box] = accepted({Shop::fingerprint(lost)});
  EXPECT_TRUE(connected(shop_.make("next", {.name = "Ada"}), std::move(next_carrier), *next_box));
  EXPECT_EQ(next_box->person(), "Ada");
}

TEST_F(TlsConnection, TakesTheFirstAlternativeNameWhereThereIsNoOther) {
  auto [carrier, box] = accepted();
  const auto files = shop_.make("x", {.name = "", .alternative_names = "IP:10.0.0.7,email:ada@shop.example,DNS:other"});
  EXPECT_TRUE(connected(files, std::move(carrier), *box));
  EXPECT_EQ(box->person(), "ada@shop.example");
}

TEST_F(TlsConnection, RefusesOlderVersionsAndHostsWithoutACertificate) {
  const auto refusalOf = [&](const std::function<void(SSL_CTX*)>& prepare) {
    auto [carrier, box] = accepted();
    RawClient client{*carrier, prepare};
    for (int k = 0; k < 1000 && box->read(buffer_).state == io::PipeState::open; ++k) client.step();
    EXPECT_FALSE(box->person());
    return std::string{box->whyClosed()};
  };
  EXPECT_THAT(refusalOf([](SSL_CTX* context) { SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION); }),
              HasSubstr("no TLS 1.3"));
  EXPECT_THAT(refusalOf({}), HasSubstr("no certificate"));
}

TEST_F(TlsConnection, ClosesWhatIsNoTls) {
  Bytes huge = bytesOf("\x16\x03\x03\xff\xff");
  huge.resize(70'000);
  for (const auto& bytes : {bytesOf("GET / HTTP/1.1\r\nHost: box\r\n\r\n"), randomBytes(2000), huge, Bytes(3000)}) {
    auto [carrier, box] = accepted();
    carrier->write(bytes);
    EXPECT_TRUE(ends(*box));
    EXPECT_FALSE(box->whyClosed().empty());
    EXPECT_FALSE(box->person());
    EXPECT_EQ(box->write(bytes).state, io::PipeState::closed);
  }
}

TEST_F(TlsConnection, EndsWithThePeerAtAnyPlaceOfTheHandshake) {
  const auto hello = [&] {
    auto [carrier, box] = carriers();
    RawClient client{*carrier, {}};
    client.step();
    Bytes bytes(4096);
    isReadable(*box, 5s);
    bytes.resize(box->read(bytes).bytes);
    return bytes;
  }();
  ASSERT_GT(hello.size(), 200U);
  for (std::size_t size = 0; size <= hello.size(); size += 17) {
    auto [carrier, box] = accepted();
    carrier->write(std::span{hello}.first(size));
    EXPECT_EQ(box->read(buffer_).state, io::PipeState::open);
    carrier.reset();
    EXPECT_TRUE(ends(*box)) << size;
    EXPECT_EQ(box->whyClosed(), "") << "nothing to warn of";
  }
}

// A carrier that brings one byte at a time.
class Trickle final : public io::BytePipe {
 public:
  explicit Trickle(Pipe of) : of_{std::move(of)} {}
  io::Transfer read(std::span<std::byte> into) override {
    return of_->read(into.first(std::min<std::size_t>(1, into.size())));
  }
  io::Transfer write(std::span<const std::byte> from) override {
    return of_->write(from.first(std::min<std::size_t>(1, from.size())));
  }
  int descriptor() const override { return of_->descriptor(); }
  std::string_view name() const override { return of_->name(); }

 private:
  Pipe of_;
};

TEST_F(TlsConnection, GoesOnByteByByte) {
  auto [carrier, box_carrier] = carriers();
  auto box = accept(context(Side::box, shop_.box()), std::make_unique<Trickle>(std::move(box_carrier)));
  ASSERT_TRUE(box);
  auto host = connected(shop_.person("Ada"), std::move(carrier), **box);
  ASSERT_TRUE(host) << host.error().what;
  EXPECT_EQ((*box)->person(), "Ada");
  (*host)->write(bytesOf("hello"));
  std::size_t bytes = 0;
  for (int k = 0; k < 1000 && bytes == 0; ++k) bytes = (*box)->read(buffer_).bytes;
  EXPECT_EQ(bytes, 5U);
}

TEST_F(TlsConnection, KeepsLittleForAPeerThatDoesNotRead) {
  const auto [host, box] = goodPair();
  const auto all = randomBytes(1'000'000);
  std::size_t sent = 0;
  for (int idle = 0; idle < 100;) {
    const auto put = box->write(std::span{all}.subspan(0, 50'000));
    sent += put.bytes;
    idle = put.bytes == 0 ? idle + 1 : 0;
    ASSERT_LT(sent, 16'000'000U) << "it takes without end";
  }
  EXPECT_FALSE(isReadable(*box, 0ms));
  std::size_t received = 0;
  while (!isReadable(*box, 0ms) && received < sent) received += host->read(buffer_).bytes;
  EXPECT_TRUE(isReadable(*box, 0ms)) << "there is room again";
  box->read(buffer_);
  EXPECT_GT(box->write(all).bytes, 0U);
}

// Each asks for an answer, and the peer reads none.
TEST_F(TlsConnection, KeyUpdatesWithoutEndHoldNoThread) {
  auto [carrier, box] = accepted();
  const auto files = shop_.person("Eve");
  RawClient client{*carrier, RawClient::with(files)};
  for (int k = 0; k < 1000 && !box->person(); ++k) {
    client.step();
    box->read(buffer_);
  }
  ASSERT_TRUE(box->person());
  for (int k = 0; k < 2000; ++k) {
    SSL_key_update(client.get(), SSL_KEY_UPDATE_REQUESTED);
    SSL_do_handshake(client.get());
    if (k % 100 == 0) box->read(buffer_);  // takes a few of them, and returns
  }
  SSL_write(client.get(), "x", 1);
  std::size_t bytes = 0;
  for (int k = 0; k < 5000 && bytes == 0; ++k) {
    client.step();
    bytes = box->read(buffer_).bytes;
  }
  EXPECT_EQ(bytes, 1U);
}

TEST_F(TlsConnection, IsOverWhenEitherSideLeavesInAnOrderlyWayOrNot) {
  for (const bool host_leaves : {true, false}) {
    auto [host, box] = goodPair();
    auto& stays = host_leaves ? box : host;
    (host_leaves ? host : box).reset();
    EXPECT_TRUE(ends(*stays));
    EXPECT_EQ(stays->write(bytesOf("x")).state, io::PipeState::closed);
    EXPECT_EQ(stays->whyClosed(), "") << "good-bye was said";
  }
}

TEST_F(TlsConnection, IsRefusedByTheHostWhereTheBoxIsNotTheOneThatWasNamed) {
  const auto refusal = [&](const KeyFiles& of_box, const std::string& name) {
    auto [carrier, box_carrier] = carriers();
    auto box = accept(context(Side::box, of_box), std::move(box_carrier));
    auto host = connected(shop_.person("Ada"), std::move(carrier), **box, name);
    return host ? std::string{} : host.error().what;
  };
  EXPECT_EQ(refusal(shop_.box(), "127.0.0.1"), "");
  EXPECT_THAT(refusal(shop_.box(), "mill-3"), HasSubstr("probebox-keys box SERIAL NAME"));
  EXPECT_THAT(refusal(shop_.box(), "10.0.0.7"), HasSubstr("probebox-keys box SERIAL ADDRESS"));
  EXPECT_THAT(refusal(shop_.make("fake", {"Eve", "DNS:localhost"}), "localhost"), HasSubstr("pretends"));
  Shop stranger{folder_.path() / "stranger"};
  auto other = stranger.box();
  other.trusted = shop_.ca();
  EXPECT_THAT(refusal(other, "localhost"), HasSubstr("boxes.crt"));
}

TEST_F(TlsConnection, DoesNotWaitForAPeerThatSaysNothing) {
  auto [carrier, box] = carriers();
  const auto silent = connect(context(Side::host, shop_.person("Ada")), std::move(carrier), "localhost", 100ms);
  ASSERT_FALSE(silent);
  EXPECT_THAT(silent.error().what, HasSubstr("does not answer"));
  auto [next_carrier, gone] = carriers();
  gone.reset();
  const auto ended = connect(context(Side::host, shop_.person("Ada")), std::move(next_carrier), "localhost", 20s);
  ASSERT_FALSE(ended);
  EXPECT_THAT(ended.error().what, HasSubstr("ended"));
}

class TlsKeys : public ::testing::Test {
 protected:
  static std::string problem(const KeyFiles& files) {
    const auto loaded = Context::load(Side::box, files);
    return loaded ? std::string{} : loaded.error().what;
  }
  const support::TemporaryFolder folder_;
  Shop shop_{folder_.path() / "shop"};
  KeyFiles good_ = shop_.box();
};

TEST_F(TlsKeys, AreRefusedByTheFileThatIsWrong) {
  EXPECT_EQ(problem(good_), "");
  const auto with = [&](std::string KeyFiles::*which, const std::string& path) {
    auto files = good_;
    files.*which = path;
    return problem(files);
  };
  const auto none = folder_.file("none.pem"), garbage = folder_.file("garbage.pem");
  std::ofstream{garbage} << "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n";
  chmod(garbage.c_str(), 0600);
  for (const auto which : {&KeyFiles::certificate, &KeyFiles::key, &KeyFiles::trusted}) {
    EXPECT_THAT(with(which, none), AllOf(HasSubstr(none), HasSubstr("No such file")));
    EXPECT_THAT(with(which, folder_.path()), HasSubstr("no file"));
    EXPECT_THAT(with(which, garbage), AllOf(HasSubstr(garbage), HasSubstr("PEM")));
  }
  EXPECT_THAT(with(&KeyFiles::key, shop_.person("Ada").key), HasSubstr("does not belong to " + good_.certificate));
  EXPECT_EQ(Context::load(Side::box, shop_.make("next", {.name = "PB-1", .last_day = 12}))->daysLeft(), 12);
  const auto old = shop_.make("old", {.name = "PB-1", .first_day = -20, .last_day = -10});
  EXPECT_THAT(problem(old), ::testing::ContainsRegex("was valid from 20..-..-.. .* to 20..-..-.. .* UTC"));
}

TEST_F(TlsKeys, AreRefusedWhereEverybodyCanReadThem) {
  chmod(good_.key.c_str(), 0644);
  EXPECT_THAT(problem(good_), AllOf(HasSubstr(good_.key), HasSubstr("chmod")));
  chmod(good_.key.c_str(), 0640);
  EXPECT_EQ(problem(good_), "") << "the group is the service's";
}

}  // namespace
}  // namespace probebox::tls
