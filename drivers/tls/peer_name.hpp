#pragma once
#include <string>

#include "protocol/units/outcome.hpp"

struct x509_st;

namespace probebox::tls {

// Returns the name of whom a certificate is about: its common name (CN), or where it has none its first e-mail address
// or DNS name (SAN). Error: it has none, several common names, or one that is no name of a person (whyNoName).
Outcome<std::string> nameIn(const x509_st& certificate);

// Returns the SHA-256 of a certificate as 64 hex digits in lower case; what `openssl x509 -fingerprint -sha256` prints,
// without colons.
std::string fingerprintOf(const x509_st& certificate);

}  // namespace probebox::tls
