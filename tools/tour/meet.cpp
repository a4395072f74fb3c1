#include <chrono>

#include "drivers/tcp/linux_tcp.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {

using namespace std::chrono_literals;

Outcome<std::unique_ptr<link::Client>> meet(const tcp::Address& box, link::StreamListener* listener) {
  TRY(auto pipe, tcp::connectTcp(box, 5s));
  auto client = std::make_unique<link::Client>(std::move(pipe), link::ClientOptions{}, listener);
  if (const auto welcome = client->connect(link::patience(10s)); !welcome) return Error{welcome.error().what};
  return client;
}

bool linger(link::Client& client, std::chrono::milliseconds duration) {
  const auto wait = link::patience(duration);
  while (client.round(wait)) {
  }
  return client.state() != link::LinkState::lost;
}

}  // namespace probebox::tour
