#pragma once
#include <string>
#include <string_view>

namespace probebox::view {

// The parts of a browser's request that show who sent it.
struct Asked {
  std::string method;  // GET, POST
  std::string path;
  std::string token;   // value of ?token=, empty without one
  std::string cookie;  // the header Cookie
  std::string host;    // the header Host
  std::string origin;  // the header Origin, empty without one
  std::string site;    // the header Sec-Fetch-Site, empty without one
};

enum class Verdict {
  let_in,
  give_cookie,    // the printed address: set the cookie and redirect to the address without the token
  wrong_host,     // a foreign name that resolves to this address: DNS rebinding
  wrong_origin,   // sent by a page of another site
  without_token,  // such as another user of this computer
};

// Admits only the page that this server has served. Every request but the first needs the cookie; a request that
// changes something must also come from the page itself.
class Gate {
 public:
  // port: of the server. token: random, new for each run.
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

// Returns 256 random bits as letters and digits.
std::string randomToken();

}  // namespace probebox::view
