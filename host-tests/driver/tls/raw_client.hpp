#pragma once
#include <functional>
#include <memory>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <string>

#include "drivers/io/byte_pipe.hpp"

namespace probebox::tls {

// A peer by OpenSSL itself, which does what drivers/tls never would. Each step is to be followed by one of the box.
class RawClient {
 public:
  RawClient(const io::BytePipe& carrier, const std::function<void(SSL_CTX*)>& prepare)
      : context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free} {
    if (prepare) prepare(context_.get());
    ssl_ = {SSL_new(context_.get()), SSL_free};
    SSL_set_fd(ssl_.get(), carrier.descriptor());
    SSL_set_connect_state(ssl_.get());
  }

  SSL* get() { return ssl_.get(); }
  // Goes on with the handshake, or reads; true when the handshake is over.
  bool step() {
    char byte = 0;
    ERR_clear_error();
    if (SSL_is_init_finished(ssl_.get()) == 0) {
      SSL_do_handshake(ssl_.get());
    } else {
      SSL_read(ssl_.get(), &byte, 1);
    }
    return SSL_is_init_finished(ssl_.get()) != 0;
  }

 private:
  std::shared_ptr<SSL_CTX> context_;
  std::shared_ptr<SSL> ssl_;
};

}  // namespace probebox::tls
