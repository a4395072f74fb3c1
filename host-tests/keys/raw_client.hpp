#pragma once
#include <functional>
#include <memory>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tls/context.hpp"

namespace probebox::support {

// A peer by OpenSSL itself, which does what drivers/tls never would. It speaks over a carrier that outlives it. Where
// the box is in this process, each step is to be followed by one of the box.
class RawClient {
 public:
  RawClient(const io::BytePipe& carrier, const std::function<void(SSL_CTX*)>& prepare)
      : context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free} {
    if (prepare) prepare(context_.get());
    ssl_ = {SSL_new(context_.get()), SSL_free};
    SSL_set_fd(ssl_.get(), carrier.descriptor());
    SSL_set_connect_state(ssl_.get());
  }

  static std::function<void(SSL_CTX*)> with(const tls::KeyFiles& files) {
    return [files](SSL_CTX* context) {
      SSL_CTX_use_certificate_chain_file(context, files.certificate.c_str());
      SSL_CTX_use_PrivateKey_file(context, files.key.c_str(), SSL_FILETYPE_PEM);
    };
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

}  // namespace probebox::support
