#include "drivers/tls/context.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <optional>
#include <sys/stat.h>

#include "drivers/io/descriptor.hpp"
#include "drivers/io/kernel_clock.hpp"
#include "drivers/tls/peer_name.hpp"

namespace probebox::tls {
namespace {

constexpr int kMostCertificatesBetween = 4;
constexpr long kMostCertificateBytes = 32L * 1024;

using ShutOut = std::vector<std::string>;

// Belongs to the SSL_CTX, which outlives the Context where connections still use it.
int shutOutIndex() {
  static const int index = SSL_CTX_get_ex_new_index(
      0, nullptr, nullptr, nullptr,
      [](void*, void* list, CRYPTO_EX_DATA*, int, long, void*) { delete static_cast<ShutOut*>(list); });
  return index;
}

bool isShutOut(const X509_STORE_CTX* store, const X509& certificate) {
  const auto* ssl = static_cast<const SSL*>(X509_STORE_CTX_get_ex_data(store, SSL_get_ex_data_X509_STORE_CTX_idx()));
  const auto* list = static_cast<const ShutOut*>(SSL_CTX_get_ex_data(SSL_get_SSL_CTX(ssl), shutOutIndex()));
  return list != nullptr && std::ranges::find(*list, fingerprintOf(certificate)) != list->end();
}

// Called for each certificate of the peer's chain, with OpenSSL's own judgement.
int judge(int good, X509_STORE_CTX* store) {
  // A box without a clock of its own begins in the past. That may let an expired certificate in, which a date in the
  // past does in any case, and would else keep everybody out until somebody has set the clock.
  if (good == 0 && X509_STORE_CTX_get_error(store) == X509_V_ERR_CERT_NOT_YET_VALID && !io::kernelClock().isKept()) {
    X509_STORE_CTX_set_error(store, X509_V_OK);
    good = 1;
  }
  if (good == 0 || X509_STORE_CTX_get_error_depth(store) != 0) return good;
  const auto& certificate = *X509_STORE_CTX_get_current_cert(store);
  if (isShutOut(store, certificate)) {
    X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_REVOKED);
    return 0;
  }
  if (!nameIn(certificate)) {
    X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_REJECTED);
    return 0;
  }
  return 1;
}

std::optional<Error> whyUnreadable(const std::string& path) {
  const io::Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  struct stat found {};
  if (file && fstat(file.get(), &found) == 0 && S_ISREG(found.st_mode)) return std::nullopt;
  const std::string why = file ? "it is no file" : std::strerror(errno);
  return Error{path + " cannot be read (" + why + "): put it there, readable for this program's user"};
}

std::optional<Error> whyOpenToAll(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0 || (found.st_mode & S_IRWXO) == 0) return std::nullopt;
  return Error{path + " is a key that everybody on this computer can read: chmod o= " + path +
               ", and make another one where strangers had access"};
}

// "2027-11-30 12:00:00 UTC"
std::string dateOf(const ASN1_TIME* time) {
  std::tm date{};
  std::array<char, 32> text{};
  if (ASN1_TIME_to_tm(time, &date) != 1) return "an unknown date";
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &date);
  return text.data();
}

std::optional<Error> whyExpired(const std::string& path, const SSL_CTX* context) {
  const auto* own = SSL_CTX_get0_certificate(context);
  if (X509_cmp_current_time(X509_get0_notAfter(own)) > 0) return std::nullopt;
  return Error{path + " was valid from " + dateOf(X509_get0_notBefore(own)) + " to " + dateOf(X509_get0_notAfter(own)) +
               ": make a new one (probebox-keys), or set this computer's clock"};
}

// Nobody is asked for a passphrase: a box starts without anybody.
int noPassphrase(char*, int, int, void*) {
  return 0;
}

std::optional<Error> whyNotLoaded(SSL_CTX* context, const KeyFiles& files) {
  for (const auto* path : {&files.certificate, &files.key, &files.trusted}) {
    if (auto error = whyUnreadable(*path)) return error;
  }
  if (auto error = whyOpenToAll(files.key)) return error;
  if (SSL_CTX_use_certificate_chain_file(context, files.certificate.c_str()) != 1)
    return Error{files.certificate +
                 " holds no certificate in PEM that is strong enough: EC P-256 or RSA 2048 at least"};
  if (SSL_CTX_use_PrivateKey_file(context, files.key.c_str(), SSL_FILETYPE_PEM) != 1) {
    const bool is_other = ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH;
    return Error{files.key + (is_other ? " does not belong to " + files.certificate + ": copy both files of one pair"
                                       : std::string{" holds no key in PEM without a passphrase"})};
  }
  if (SSL_CTX_check_private_key(context) != 1)
    return Error{files.key + " does not belong to " + files.certificate + ": copy both files of one pair"};
  if (SSL_CTX_load_verify_file(context, files.trusted.c_str()) != 1)
    return Error{files.trusted + " holds no certificate of a CA in PEM"};
  return whyExpired(files.certificate, context);
}

}  // namespace

Outcome<Context> Context::load(Side side, const KeyFiles& files, std::vector<std::string> shut_out) {
  std::shared_ptr<SSL_CTX> context{SSL_CTX_new(side == Side::box ? TLS_server_method() : TLS_client_method()),
                                   SSL_CTX_free};
  if (!context) return Error{"TLS cannot be used: OpenSSL makes no context, check its configuration (openssl.cnf)"};
  auto* raw = context.get();
  SSL_CTX_set_min_proto_version(raw, TLS1_3_VERSION);
  SSL_CTX_set_options(raw, SSL_OP_NO_TICKET | SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_num_tickets(raw, 0);
  SSL_CTX_set_session_cache_mode(raw, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_mode(raw, SSL_MODE_RELEASE_BUFFERS);
  // One record a call: a peer that sends nothing but key updates does not hold the thread.
  SSL_CTX_clear_mode(raw, SSL_MODE_AUTO_RETRY);
  SSL_CTX_set_max_cert_list(raw, kMostCertificateBytes);
  SSL_CTX_set_verify_depth(raw, kMostCertificatesBetween);
  SSL_CTX_set_verify(raw, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, judge);
  SSL_CTX_set_default_passwd_cb(raw, noPassphrase);
  SSL_CTX_set_ex_data(raw, shutOutIndex(), new ShutOut{std::move(shut_out)});
  ERR_clear_error();
  auto error = whyNotLoaded(raw, files);
  ERR_clear_error();
  if (error) return *std::move(error);
  return Context{side, std::move(context)};
}

std::string Context::ownName() const {
  const auto name = nameIn(*SSL_CTX_get0_certificate(context_.get()));
  return name ? *name : std::string{};
}

int Context::daysLeft() const {
  int days = 0;
  int seconds = 0;
  const auto* own = SSL_CTX_get0_certificate(context_.get());
  return ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(own)) == 1 ? days : 0;
}

}  // namespace probebox::tls
