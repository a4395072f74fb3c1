#include "drivers/tls/connection.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <ctime>
#include <netinet/in.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <optional>
#include <poll.h>
#include <utility>
#include <vector>

#include "drivers/tls/failure.hpp"
#include "drivers/tls/linux_readiness.hpp"
#include "drivers/tls/peer_name.hpp"

namespace probebox::tls {
namespace {

constexpr std::size_t kMostPlain = 16 * 1024;    // bytes of one record (RFC 8446, 5.1)
constexpr std::size_t kMostUnsent = 64 * 1024;   // of a peer that sends and does not read
constexpr int kMostRecords = 8;                  // in one call: one peer does not keep the thread from others
constexpr std::chrono::milliseconds kSlice{50};  // between looks at the time

struct FreeConnection {
  void operator()(SSL* ssl) const { SSL_free(ssl); }
};

// Between OpenSSL and the carrier. What OpenSSL sends is kept here until the carrier takes it, so that a write is never
// half done inside OpenSSL, which would ask for the very same bytes again.
class Carrier {
 public:
  explicit Carrier(std::unique_ptr<io::BytePipe> pipe) : pipe_{std::move(pipe)} {}

  const io::BytePipe& pipe() const { return *pipe_; }
  std::size_t unsent() const { return out_.size() - sent_; }

  int read(std::span<std::byte> into) {
    const auto got = pipe_->read(into);
    received_ = received_ || got.bytes > 0;
    ended_ = got.bytes == 0 && got.state == io::PipeState::closed;
    return got.bytes > 0 ? static_cast<int>(got.bytes) : ended_ ? 0 : -1;
  }
  void keep(std::span<const std::byte> bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }
  // A carrier that takes nothing any more is found out by reading: what it has brought before may say why.
  void flush() {
    while (unsent() > 0) {
      const auto put = pipe_->write(std::span{out_}.subspan(sent_));
      sent_ += put.bytes;
      if (put.state == io::PipeState::closed) sent_ = out_.size();
      if (put.bytes == 0) break;
    }
    if (unsent() > 0) return;
    out_.clear();
    sent_ = 0;
  }

  bool takeReceived() { return std::exchange(received_, false); }
  bool ended() const { return ended_; }

 private:
  std::unique_ptr<io::BytePipe> pipe_;
  std::vector<std::byte> out_;
  std::size_t sent_{};
  bool received_{};
  bool ended_{};
};

int readCarrier(BIO* bio, char* into, int size) {
  BIO_clear_retry_flags(bio);
  auto& carrier = *static_cast<Carrier*>(BIO_get_data(bio));
  const int bytes = carrier.read(std::as_writable_bytes(std::span{into, static_cast<std::size_t>(size)}));
  if (bytes < 0) BIO_set_retry_read(bio);
  return bytes;
}

int writeCarrier(BIO* bio, const char* from, int size) {
  static_cast<Carrier*>(BIO_get_data(bio))->keep(std::as_bytes(std::span{from, static_cast<std::size_t>(size)}));
  return size;
}

long controlCarrier(BIO* bio, int command, long, void*) {
  if (command == BIO_CTRL_FLUSH) return 1;
  return command == BIO_CTRL_EOF && static_cast<Carrier*>(BIO_get_data(bio))->ended() ? 1 : 0;
}

const BIO_METHOD* carrierMethod() {
  static BIO_METHOD* const method = [] {
    auto* made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "probebox carrier");
    BIO_meth_set_read(made, readCarrier);
    BIO_meth_set_write(made, writeCarrier);
    BIO_meth_set_ctrl(made, controlCarrier);
    return made;
  }();
  return method;
}

class TlsPipe final : public io::BytePipe {
 public:
  TlsPipe(const Context& context, std::unique_ptr<io::BytePipe> carrier, Readiness readiness)
      : side_{context.side()},
        carrier_{std::move(carrier)},
        name_{"tls:" + afterScheme(carrier_.pipe().name())},
        readiness_{std::move(readiness)},
        ssl_{SSL_new(context.get())} {
    auto* bio = BIO_new(carrierMethod());
    BIO_set_data(bio, &carrier_);
    BIO_set_init(bio, 1);
    SSL_set_bio(ssl_.get(), bio, bio);
    if (side_ == Side::box) {
      SSL_set_accept_state(ssl_.get());
    } else {
      SSL_set_connect_state(ssl_.get());
    }
  }
  ~TlsPipe() override {
    if (state_ == io::PipeState::closed || SSL_is_init_finished(ssl_.get()) == 0) return;
    ERR_clear_error();
    SSL_shutdown(ssl_.get());  // says good-bye, and does not wait for the answer
    ERR_clear_error();
    carrier_.flush();
  }

  io::Transfer read(std::span<std::byte> into) override {
    carrier_.flush();
    if (expires_ && state_ == io::PipeState::open && std::time(nullptr) > *expires_) {
      state_ = io::PipeState::closed;
      why_closed_ = "the certificate of " + person_.value_or("the peer") +
                    " has expired while it was connected: put the next one there (probebox-keys, --renew)";
    }
    std::size_t bytes = 0;
    for (int record = 0; record < kMostRecords && bytes == 0 && mayRead() && !into.empty(); ++record) {
      carrier_.takeReceived();
      ERR_clear_error();
      const int result = SSL_read_ex(ssl_.get(), into.data(), into.size(), &bytes);
      if (result != 1) look(SSL_get_error(ssl_.get(), result));
      if (result != 1 && !carrier_.takeReceived()) break;
    }
    settle();
    return {bytes, state_};
  }

  io::Transfer write(std::span<const std::byte> from) override {
    carrier_.flush();
    std::size_t bytes = 0;
    while (bytes < from.size() && state_ == io::PipeState::open && carrier_.unsent() == 0 &&
           SSL_is_init_finished(ssl_.get()) != 0) {
      std::size_t written = 0;
      const auto part = from.subspan(bytes, std::min(kMostPlain, from.size() - bytes));
      ERR_clear_error();
      const int result = SSL_write_ex(ssl_.get(), part.data(), part.size(), &written);
      if (result != 1) {
        look(SSL_get_error(ssl_.get(), result));
        break;
      }
      bytes += written;
      carrier_.flush();
    }
    settle();
    return {bytes, state_};
  }

  int descriptor() const override { return readiness_.descriptor(); }
  bool watchedForWriting() const override { return false; }
  std::string_view name() const override { return name_; }
  const std::optional<std::string>& person() const override { return person_; }
  std::string_view whyClosed() const override { return why_closed_; }

  bool isClosed() const { return state_ == io::PipeState::closed; }
  // True when the handshake is over.
  bool shakeHands() {
    ERR_clear_error();
    const int result = SSL_do_handshake(ssl_.get());
    if (result != 1) look(SSL_get_error(ssl_.get(), result));
    settle();
    return result == 1;
  }
  // True when the peer's certificate will have to have this name.
  bool expect(const std::string& name) {
    in6_addr address{};
    const bool is_address =
        inet_pton(AF_INET, name.c_str(), &address) == 1 || inet_pton(AF_INET6, name.c_str(), &address) == 1;
    if (is_address) return X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_.get()), name.c_str()) == 1;
    SSL_set_hostflags(ssl_.get(), X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
    return SSL_set1_host(ssl_.get(), name.c_str()) == 1;
  }

 private:
  static std::string afterScheme(std::string_view name) {
    return std::string{name.substr(name.starts_with("tcp:") ? 4 : 0)};
  }
  bool mayRead() const { return state_ == io::PipeState::open && carrier_.unsent() < kMostUnsent; }

  void look(int error) {
    if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) return;
    state_ = io::PipeState::closed;
    if (error != SSL_ERROR_ZERO_RETURN) why_closed_ = whyFailed(*ssl_, side_);
    ERR_clear_error();
  }

  // After every call of OpenSSL: sends what it has to say, and sees to the descriptor.
  void settle() {
    carrier_.flush();
    if (!person_ && SSL_is_init_finished(ssl_.get()) != 0) {
      const auto* certificate = SSL_get0_peer_certificate(ssl_.get());
      if (auto name = certificate == nullptr ? Outcome<std::string>{Error{}} : nameIn(*certificate)) person_ = *name;
      tm date{};
      if (certificate != nullptr && ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &date) == 1)
        expires_ = timegm(&date);
    }
    readiness_.wantRoom(carrier_.unsent() > 0);
    readiness_.bytesWait(SSL_pending(ssl_.get()) > 0);
  }

  Side side_;
  Carrier carrier_;
  std::string name_;
  Readiness readiness_;
  std::unique_ptr<SSL, FreeConnection> ssl_;
  std::optional<std::string> person_;
  std::optional<std::time_t> expires_;  // the peer's certificate, by this computer's clock
  std::string why_closed_;
  io::PipeState state_{io::PipeState::open};
};

}  // namespace

Outcome<std::unique_ptr<io::BytePipe>> accept(const Context& box, std::unique_ptr<io::BytePipe> carrier) {
  TRY(auto readiness, Readiness::watch(carrier->descriptor()));
  return std::unique_ptr<io::BytePipe>{std::make_unique<TlsPipe>(box, std::move(carrier), std::move(readiness))};
}

Outcome<std::unique_ptr<io::BytePipe>> connect(const Context& host, std::unique_ptr<io::BytePipe> carrier,
                                               const std::string& name, std::chrono::milliseconds patience) {
  TRY(auto readiness, Readiness::watch(carrier->descriptor()));
  auto pipe = std::make_unique<TlsPipe>(host, std::move(carrier), std::move(readiness));
  const std::string who{pipe->name()};
  if (!pipe->expect(name)) return Error{who + ": '" + name + "' is no name of a computer"};
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!pipe->shakeHands()) {
    if (pipe->isClosed()) {
      const auto why = pipe->whyClosed();
      return Error{who + ": " + (why.empty() ? "it ended the connection; its log says why" : std::string{why})};
    }
    if (std::chrono::steady_clock::now() >= end)
      return Error{who + ": it does not answer by TLS; check that this is the port of the box's tls: link"};
    pollfd wait{pipe->descriptor(), POLLIN, 0};
    poll(&wait, 1, static_cast<int>(kSlice.count()));
  }
  return std::unique_ptr<io::BytePipe>{std::move(pipe)};
}

}  // namespace probebox::tls
