#include "host-tests/keys/shop.hpp"

#include <cstdio>
#include <memory>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <stdexcept>
#include <sys/stat.h>

#include "drivers/tls/peer_name.hpp"

namespace probebox::support {
namespace {

constexpr long kDay_s = 24L * 3600;

template <class T, void (*release)(T*)>
struct Free {
  void operator()(T* it) const { release(it); }
};
using Certificate = std::unique_ptr<X509, Free<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY, EVP_PKEY_free>>;

struct Closed {
  void operator()(FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<FILE, Closed>;

File opened(const std::filesystem::path& path, const char* mode) {
  File file{std::fopen(path.c_str(), mode)};
  if (!file) throw std::runtime_error{path.string()};
  return file;
}

void save(const std::filesystem::path& stem, X509& certificate, EVP_PKEY& key) {
  PEM_write_X509(opened(stem.string() + ".crt", "w").get(), &certificate);
  PEM_write_PrivateKey(opened(stem.string() + ".key", "w").get(), &key, nullptr, nullptr, 0, nullptr, nullptr);
  chmod((stem.string() + ".key").c_str(), 0600);
}

Certificate certificateAt(const std::string& path) {
  return Certificate{PEM_read_X509(opened(path, "r").get(), nullptr, nullptr, nullptr)};
}

void extend(X509& certificate, int id, const std::string& value) {
  if (value.empty()) return;
  auto* extension = X509V3_EXT_conf_nid(nullptr, nullptr, id, value.c_str());
  if (extension == nullptr) throw std::runtime_error{value};
  X509_add_ext(&certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

Certificate unsignedCertificate(const Wanted& wanted, EVP_PKEY& key) {
  static long serial = 0;
  Certificate made{X509_new()};
  X509_set_version(made.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), ++serial);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), wanted.first_day * kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), wanted.last_day * kDay_s + wanted.last_second);
  X509_set_pubkey(made.get(), &key);
  auto names = wanted.more_names;
  if (!wanted.name.empty()) names.insert(names.begin(), wanted.name);
  for (const auto& name : names)
    X509_NAME_add_entry_by_txt(X509_get_subject_name(made.get()), "CN", MBSTRING_UTF8,
                               reinterpret_cast<const unsigned char*>(name.data()), static_cast<int>(name.size()), -1,
                               0);
  return made;
}

}  // namespace

Shop::Shop(const std::filesystem::path& folder) : folder_{folder} {
  std::filesystem::create_directories(folder_);
  const Key key{EVP_EC_gen("P-256")};
  const auto ca = unsignedCertificate({.name = "CA of " + folder_.filename().string()}, *key);
  extend(*ca, NID_basic_constraints, "critical,CA:TRUE");
  X509_set_issuer_name(ca.get(), X509_get_subject_name(ca.get()));
  X509_sign(ca.get(), key.get(), EVP_sha256());
  save(folder_ / "ca", *ca, *key);
}

tls::KeyFiles Shop::make(const std::string& file, const Wanted& wanted) {
  const Key ca_key{PEM_read_PrivateKey(opened(folder_ / "ca.key", "r").get(), nullptr, nullptr, nullptr)};
  const auto ca_certificate = certificateAt(ca());
  const Key key{EVP_EC_gen("P-256")};
  const auto made = unsignedCertificate(wanted, *key);
  extend(*made, NID_ext_key_usage, wanted.usage);
  extend(*made, NID_subject_alt_name, wanted.alternative_names);
  X509_set_issuer_name(made.get(), X509_get_subject_name(ca_certificate.get()));
  X509_sign(made.get(), ca_key.get(), EVP_sha256());
  save(folder_ / file, *made, *key);
  return {
      .certificate = (folder_ / file).string() + ".crt", .key = (folder_ / file).string() + ".key", .trusted = ca()};
}

std::string Shop::fingerprint(const tls::KeyFiles& files) {
  return tls::fingerprintOf(*certificateAt(files.certificate));
}

}  // namespace probebox::support
