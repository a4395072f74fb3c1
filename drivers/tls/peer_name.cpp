#include "drivers/tls/peer_name.hpp"

#include <array>
#include <memory>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <string_view>

#include "protocol/units/wording.hpp"

namespace probebox::tls {
namespace {

struct FreeNames {
  void operator()(GENERAL_NAMES* names) const { GENERAL_NAMES_free(names); }
};

std::string utf8Of(const ASN1_STRING* text) {
  unsigned char* bytes = nullptr;
  const int length = ASN1_STRING_to_UTF8(&bytes, text);
  if (length < 0) return {};
  std::string utf8{reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(length)};
  OPENSSL_free(bytes);
  return utf8;
}

// Empty where it has none.
std::string alternativeNameIn(const X509& certificate) {
  const std::unique_ptr<GENERAL_NAMES, FreeNames> names{
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr))};
  for (int k = 0; names && k < sk_GENERAL_NAME_num(names.get()); ++k) {
    const auto* name = sk_GENERAL_NAME_value(names.get(), k);
    if (name->type == GEN_EMAIL || name->type == GEN_DNS) return utf8Of(name->d.ia5);
  }
  return {};
}

}  // namespace

Outcome<std::string> nameIn(const X509& certificate) {
  const auto* subject = X509_get_subject_name(&certificate);
  const int first = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (first >= 0 && X509_NAME_get_index_by_NID(subject, NID_commonName, first) >= 0)
    return Error{"The certificate has several common names, and nobody knows which one signs: make one with one CN"};
  auto name = first < 0 ? alternativeNameIn(certificate)
                        : utf8Of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, first)));
  if (auto why = whyNoName(name)) return Error{"The certificate names nobody who could sign. " + why->what};
  return name;
}

std::string fingerprintOf(const X509& certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (X509_digest(&certificate, EVP_sha256(), digest.data(), &size) != 1) return {};
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (unsigned int k = 0; k < size; ++k) {
    text += kDigits[digest.at(k) >> 4U];
    text += kDigits[digest.at(k) & 0xFU];
  }
  return text;
}

}  // namespace probebox::tls
