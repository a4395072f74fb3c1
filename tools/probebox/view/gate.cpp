#include "tools/probebox/view/gate.hpp"

#include <array>
#include <span>
#include <sys/random.h>
#include <utility>

#include "protocol/units/wording.hpp"

namespace probebox::view {
namespace {

// In the same time wherever they differ.
bool same(std::string_view one, std::string_view other) {
  if (one.size() != other.size()) return false;
  unsigned differs = 0;
  for (std::size_t k = 0; k < one.size(); ++k) differs |= static_cast<unsigned char>(one[k] ^ other[k]);
  return differs == 0;
}

}  // namespace

Gate::Gate(unsigned port, std::string token) : port_{std::to_string(port)}, token_{std::move(token)} {}

// Cookies know no ports: two views on one computer have each their own.
std::string Gate::cookie() const {
  return "probebox" + port_ + "=" + token_ + "; Path=/; HttpOnly; SameSite=Strict";
}

bool Gate::isOurs(std::string_view host) const {
  return host == "127.0.0.1:" + port_ || host == "localhost:" + port_;
}

bool Gate::hasCookie(std::string_view header) const {
  const std::string name = "probebox" + port_ + "=";
  while (!header.empty()) {
    const auto end = header.find(';');
    auto one = header.substr(0, end);
    while (!one.empty() && one.front() == ' ') one.remove_prefix(1);
    if (one.starts_with(name) && same(one.substr(name.size()), token_)) return true;
    if (end == std::string_view::npos) break;
    header.remove_prefix(end + 1);
  }
  return false;
}

Verdict Gate::judge(const Asked& asked) const {
  constexpr std::string_view kScheme = "http://";
  if (!isOurs(asked.host)) return Verdict::wrong_host;
  const bool own_origin = asked.origin == std::string{kScheme} + asked.host;
  if (!asked.origin.empty() && !own_origin) return Verdict::wrong_origin;
  const bool reads = asked.method == "GET" || asked.method == "HEAD";
  if (!reads && !own_origin) return Verdict::wrong_origin;
  if (reads && asked.path == "/" && !asked.token.empty())
    return same(asked.token, token_) ? Verdict::give_cookie : Verdict::without_token;
  if (!asked.site.empty() && asked.site != "same-origin" && asked.site != "none") return Verdict::wrong_origin;
  return hasCookie(asked.cookie) ? Verdict::let_in : Verdict::without_token;
}

std::string randomToken() {
  std::array<unsigned char, 32> bytes{};
  std::size_t had = 0;
  while (had < bytes.size()) {
    const auto got = getrandom(bytes.data() + had, bytes.size() - had, 0);
    if (got > 0) had += static_cast<std::size_t>(got);
  }
  return hexadecimal(std::as_bytes(std::span{bytes}));
}

}  // namespace probebox::view
