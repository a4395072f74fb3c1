#pragma once
#include <chrono>
#include <memory>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tls/context.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::tls {

// Puts the box's end of TLS on a connection that has just come. The handshake goes on in read(), so nothing waits here;
// until it is over, read() delivers no byte and person() is empty. A peer that fails it makes read() return `closed`,
// with the reason in whyClosed(). The caller limits the time. Error: no descriptor is left.
Outcome<std::unique_ptr<io::BytePipe>> accept(const Context& box, std::unique_ptr<io::BytePipe> carrier);

// Makes the host's end and waits at most `patience` for the handshake. name: a DNS name or an IP address, one of which
// the box's certificate must have (SAN). Error: why not, with the remedy. A box that refuses the host's certificate
// says so after the handshake of TLS 1.3: then the first read() returns `closed`.
Outcome<std::unique_ptr<io::BytePipe>> connect(const Context& host, std::unique_ptr<io::BytePipe> carrier,
                                               const std::string& name, std::chrono::milliseconds patience);

}  // namespace probebox::tls
