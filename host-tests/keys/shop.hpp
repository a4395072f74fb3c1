#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/tls/context.hpp"

namespace probebox::support {

// What a certificate is to say. Days count from now.
struct Wanted {
  std::string name;                 // CN; empty: none
  std::string alternative_names{};  // SAN as OpenSSL writes it: "DNS:localhost,IP:127.0.0.1"; empty: none
  std::string usage{"clientAuth"};  // of its key; empty: any
  int first_day{-1};
  int last_day{30};
  int last_second{};  // beyond it
  std::vector<std::string> more_names{};  // further CNs
};

// A shop's CA with the certificates that it signs, EC P-256, as files of a folder.
class Shop {
 public:
  explicit Shop(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  std::string ca() const { return (folder_ / "ca.crt").string(); }
  // Makes key and certificate; the files are named `file`.crt and `file`.key. It trusts this shop.
  tls::KeyFiles make(const std::string& file, const Wanted& wanted);
  tls::KeyFiles box() { return make("box", {"PB-1", "DNS:localhost,IP:127.0.0.1", "serverAuth"}); }
  tls::KeyFiles person(const std::string& name) { return make(name, {name}); }
  // As service.toml takes it.
  static std::string fingerprint(const tls::KeyFiles& files);

 private:
  std::filesystem::path folder_;
};

}  // namespace probebox::support
