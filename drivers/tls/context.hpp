#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"

struct ssl_ctx_st;

// TLS 1.3 with certificates of both sides (RFC 8446). What is left out: older versions, session tickets, early data,
// renegotiation, compression.
namespace probebox::tls {

enum class Side : std::uint8_t { box, host };

// Files in PEM.
struct KeyFiles {
  std::string certificate;  // one's own, and those between it and its CA
  std::string key;          // that belongs to it; without a passphrase, and not readable by everybody
  std::string trusted;      // CAs of the peers
};

// Keys of one side, loaded and checked. Copies share them; connections outlive the object that they were made from.
class Context {
 public:
  // shut_out: SHA-256 of peers' certificates that are refused although their CA is trusted, as kFingerprintDigits hex
  // digits in lower case. Error: the file that is missing, unreadable, no PEM, expired, readable by everybody, or does
  // not belong to the other, with the remedy.
  static Outcome<Context> load(Side side, const KeyFiles& files, std::vector<std::string> shut_out = {});

  Side side() const { return side_; }
  // Whom the own certificate names; empty where it names nobody who could sign.
  std::string ownName() const;
  // Whole days until the own certificate expires, by this computer's clock.
  int daysLeft() const;
  ssl_ctx_st* get() const { return context_.get(); }

 private:
  Context(Side side, std::shared_ptr<ssl_ctx_st> context) : side_{side}, context_{std::move(context)} {}

  Side side_;
  std::shared_ptr<ssl_ctx_st> context_;
};

}  // namespace probebox::tls
