#include "drivers/tls/failure.hpp"

#include <algorithm>
#include <array>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <string_view>

namespace probebox::tls {
namespace {

struct Words {
  long code;
  std::string_view of_box;   // said by the box
  std::string_view of_host;  // said by the host
};

// What this side finds wrong with the peer's certificate.
constexpr std::array kVerdicts{
    Words{X509_V_ERR_CERT_HAS_EXPIRED, "its certificate has expired, or this box's clock is wrong",
          "the box's certificate has expired: make it a new one (probebox-keys box), or set this computer's clock"},
    Words{X509_V_ERR_CERT_NOT_YET_VALID, "its certificate is not valid yet, or this box's clock is wrong",
          "the box's certificate is not valid yet: set this computer's clock"},
    Words{X509_V_ERR_CERT_REVOKED, "its certificate is shut out by service.toml", "the box's certificate is shut out"},
    Words{X509_V_ERR_CERT_REJECTED, "its certificate names nobody who could sign",
          "the box's certificate has no name: make it a new one (probebox-keys box)"},
    Words{X509_V_ERR_INVALID_PURPOSE, "its certificate is not one of a person",
          "its certificate is not one of a box: this may be somebody who pretends to be one"},
    Words{X509_V_ERR_HOSTNAME_MISMATCH, "",
          "the box there has another name: write the one that its certificate has, or make it one with this name "
          "(probebox-keys box SERIAL NAME...)"},
    Words{X509_V_ERR_IP_ADDRESS_MISMATCH, "",
          "the box's certificate does not have this address: write the box's name, or make it a certificate with the "
          "address (probebox-keys box SERIAL ADDRESS...)"}};

// What the peer says of us (RFC 8446, 6.2).
constexpr std::array kAlerts{
    Words{SSL_AD_CERTIFICATE_REQUIRED, "it wants a certificate",
          "the box wants a certificate (probebox-keys person NAME)"},
    Words{SSL_AD_UNKNOWN_CA, "it does not know the CA of this box's certificate",
          "the box does not know the CA of your certificate: take one of its shop (probebox-keys person NAME)"},
    Words{SSL_AD_CERTIFICATE_EXPIRED, "it says that this box's certificate has expired",
          "the box says that your certificate has expired: make a new one (probebox-keys person NAME); if it has not, "
          "the box's clock is wrong"},
    Words{SSL_AD_CERTIFICATE_REVOKED, "it shuts this box's certificate out",
          "your certificate is shut out by the box's service.toml: take a new one (probebox-keys person NAME)"},
    Words{SSL_AD_BAD_CERTIFICATE, "it does not take this box's certificate",
          "your certificate names nobody who could sign: make one with a name that prints (probebox-keys person NAME)"},
    Words{SSL_AD_UNSUPPORTED_CERTIFICATE, "it does not take this box's certificate",
          "your certificate is not one of a person: make one (probebox-keys person NAME)"},
    Words{SSL_AD_PROTOCOL_VERSION, "it speaks no TLS 1.3", "the box speaks no TLS 1.3: update it"}};

template <std::size_t N>
std::string wordsFor(const std::array<Words, N>& all, long code, Side side) {
  const auto found = std::ranges::find(all, code, &Words::code);
  if (found == all.end()) return {};
  return std::string{side == Side::box ? found->of_box : found->of_host};
}

std::string wordsForReason(int reason, Side side) {
  if (reason > SSL_AD_REASON_OFFSET) return wordsFor(kAlerts, reason - SSL_AD_REASON_OFFSET, side);
  switch (reason) {
    case SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE:
      return "it showed no certificate";
    case SSL_R_UNSUPPORTED_PROTOCOL:
    case SSL_R_NO_PROTOCOLS_AVAILABLE:
      return "it speaks no TLS 1.3";
    case SSL_R_WRONG_VERSION_NUMBER:
    case SSL_R_HTTP_REQUEST:
    case SSL_R_UNEXPECTED_MESSAGE:
      return "what it says is no TLS" +
             std::string{side == Side::host ? ": check the port, which is 7628 as a rule" : ""};
    default:
      return {};
  }
}

}  // namespace

std::string whyFailed(const SSL& connection, Side side) {
  const auto code = ERR_peek_error();
  ERR_clear_error();
  const long verdict = SSL_get_verify_result(&connection);
  if (code != 0 && ERR_GET_REASON(code) == SSL_R_CERTIFICATE_VERIFY_FAILED) {
    if (auto words = wordsFor(kVerdicts, verdict, side); !words.empty()) return words;
    return std::string{"its certificate is of no trusted CA ("} + X509_verify_cert_error_string(verdict) + ")" +
           (side == Side::host ? ": take the CA of the shop that the box belongs to (boxes.crt)" : "");
  }
  if (code == 0 || ERR_GET_REASON(code) == SSL_R_UNEXPECTED_EOF_WHILE_READING) return {};
  if (auto words = wordsForReason(ERR_GET_REASON(code), side); !words.empty()) return words;
  const char* reason = ERR_reason_error_string(code);
  return "TLS failed (" + std::string{reason == nullptr ? "for an unknown reason" : reason} + ")";
}

}  // namespace probebox::tls
