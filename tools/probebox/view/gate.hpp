#pragma once
#include <string>
#include <string_view>

namespace probebox::view {

// What a browser says of a request, as far as it matters who asks.
struct Asked {
  std::string method;  // GET, POST
  std::string path;
  std::string token;   // of ?token=, empty without one
  std::string cookie;  // the header Cookie
  std::string host;    // the header Host
  std::string origin;  // the header Origin, empty without one
  std::string site;    // the header Sec-Fetch-Site, empty without one
};

enum class Verdict {
  let_in,
  give_cookie,    // the address that was printed: the browser gets its cookie, and the address without the token
  wrong_host,     // a name that leads here and is not ours: DNS rebinding
  wrong_origin,   // another page asks
  without_token,  // somebody else on this computer
};

// Lets only the page in that this server has served. Everything but the first request needs the cookie; whoever changes
// something has to be the page itself.
class Gate {
 public:
  // port: where it listens. token: random, of this run.
  Gate(unsigned port, std::string token);

  Verdict judge(const Asked& asked) const;
  std::string cookie() const;  // for Set-Cookie
  const std::string& token() const { return token_; }

 private:
  bool isOurs(std::string_view host) const;
  bool hasCookie(std::string_view header) const;

  std::string port_;
  std::string token_;
};

// 256 random bits as letters and digits.
std::string randomToken();

}  // namespace probebox::view
