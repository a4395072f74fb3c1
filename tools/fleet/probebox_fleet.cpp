// Faces of one box towards engines that watch many: /metrics for Prometheus, MQTT for results.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <iostream>
#include <optional>
#include <poll.h>
#include <systemd/sd-daemon.h>
#include <utility>
#include <vector>

#include "tools/fleet/options.hpp"
#include "tools/fleet/publisher.hpp"
#include "tools/fleet/scrape_server.hpp"
#include "tools/probebox/commands/observed_box.hpp"
#include "tools/probebox/link/box.hpp"

namespace {

using namespace probebox;
using command::Console;
using command::Trouble;

std::atomic<bool> interrupted{false};

constexpr int kWrongUsage = 2;
constexpr int kPause_ms = 100;  // the link needs signs of life
constexpr Nanoseconds kTryAgainAfter{2'000'000'000};
constexpr Nanoseconds kFreshFor{1'000'000'000};
constexpr command::milliseconds kPatience{1000};

// The one box, over as many links as that takes.
class WatchedBox {
 public:
  WatchedBox(std::string uri, Console& console) : uri_{std::move(uri)}, console_{console} {}

  // Null while it does not answer.
  link::Client* link(MonoTime now) {
    if (link_ && link_->poll(now) == link::LinkState::lost) lose(link_->failure()->what);
    if (!link_ && now - tried_ >= kTryAgainAfter) {
      tried_ = now;
      connect();
    }
    return link_.get();
  }
  // What it says of itself, not older than a second; null while it does not answer.
  const fleet::Observed* observed(MonoTime now) {
    if (seen_ && now - seen_at_ < kFreshFor) return &*seen_;
    auto* box = link(now);
    if (box == nullptr) return nullptr;
    auto seen = command::observedBox(*box, console_, seen_ ? &*seen_ : nullptr);
    if (!seen) return lose(seen.error().what), nullptr;
    seen_ = std::move(*seen);
    seen_at_ = link::now();
    return &*seen_;
  }
  void lose(const std::string& why) {
    say(why);
    link_.reset();
    seen_.reset();
  }

 private:
  void connect() {
    const auto uri = command::chooseUri(uri_);
    if (!uri) return say(uri.error().what);
    auto link = command::openBox(*uri, console_, kPatience);
    if (!link) return say(link.error().what);
    link_ = std::move(*link);
    say("the box at " + uri->text + " answers: " + link_->described().serial_number);
  }
  void say(const std::string& what) {
    if (std::exchange(said_, what) != what) console_.note("probebox-fleet: " + what);
  }

  std::string uri_;
  Console& console_;
  command::Box link_;
  std::optional<fleet::Observed> seen_;
  MonoTime seen_at_{}, tried_{};
  std::string said_;
};

Outcome<std::optional<fleet::ScrapeServer>> serverOf(const fleet::Options& options) {
  std::optional<fleet::ScrapeServer> server;
  if (!options.listen.empty()) {
    TRY(const auto address, tcp::parseAddress(options.listen));
    TRY(auto listener, tcp::Listener::open(address));
    server.emplace(std::move(listener));
  } else if (sd_listen_fds(1) > 0) {
    TRY(auto listener, tcp::Listener::adopt(io::Descriptor{SD_LISTEN_FDS_START}, "probebox-fleet.socket"));
    server.emplace(std::move(listener));
  }
  return server;
}

void wait(const std::optional<fleet::ScrapeServer>& server, const link::Client* box) {
  std::vector<pollfd> watched;
  if (server) {
    for (const int each : server->descriptors()) watched.push_back({each, POLLIN, 0});
  }
  if (box != nullptr) watched.push_back({box->descriptor(), POLLIN, 0});
  ::poll(watched.data(), watched.size(), kPause_ms);
}

void serve(const fleet::Options& options, std::optional<fleet::ScrapeServer> server,
           std::optional<fleet::Publisher> publisher, Console& console) {
  const Nanoseconds state_every{static_cast<std::int64_t>(options.state_every_s * 1e9)};
  WatchedBox box{options.uri, console};
  MonoTime told_state{};
  bool was_there = false;
  while (!interrupted) {
    const auto now = link::now();
    auto* link = box.link(now);
    if (publisher) {
      if (const auto trouble = publisher->round(link, now)) box.lose(trouble->what), link = nullptr;
      const bool is_there = link != nullptr;
      if (is_there != was_there || publisher->wantsState() || now - told_state >= state_every) {
        publisher->publishState(box.observed(now));
        told_state = now;
      }
      was_there = is_there;
    }
    if (server) {
      server->round(link::now(), [&] {
        fleet::Exposition text;
        fleet::addBox(text, box.observed(link::now()));
        if (publisher) publisher->addMetrics(text);
        return text.text();
      });
    }
    wait(server, box.link(link::now()));
  }
  // An orderly end has no last will.
  if (publisher) publisher->publishState(nullptr);
}

int fail(const Error& error) {
  std::cerr << "probebox-fleet: " << error.what << "\n";
  return kWrongUsage;
}

}  // namespace

int main(int count, char** words) {
  fleet::Options options;
  CLI::App line;
  fleet::declareOptions(line, options);
  try {
    line.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return line.exit(error) == 0 ? 0 : kWrongUsage;
  }
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { interrupted = true; });
  std::signal(SIGPIPE, SIG_IGN);
  auto broker = fleet::brokerOf(options);
  if (!broker) return fail(broker.error());
  auto server = serverOf(options);
  if (!server) return fail(server.error());
  if (!*server && !*broker) return fail({"nothing to do: name --listen, --mqtt, or both"});
  if (*server) std::cerr << "probebox-fleet: http://" << tcp::describe((*server)->address()) << "/metrics\n";
  Console console{{std::cin, std::cout, std::cerr, false, false, 0, interrupted}, false};
  std::optional<fleet::Publisher> publisher;
  if (*broker) publisher.emplace(**broker, options.state, console);
  serve(options, std::move(*server), std::move(publisher), console);
  return 0;
}
