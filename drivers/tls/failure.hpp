#pragma once
#include <string>

#include "drivers/tls/context.hpp"

struct ssl_st;

namespace probebox::tls {

// Says why a connection has failed, by what OpenSSL left on its queue of errors, which is empty afterwards; with the
// remedy. Empty where the peer has ended it without a word. side: this one.
std::string whyFailed(const ssl_st& connection, Side side);

}  // namespace probebox::tls
