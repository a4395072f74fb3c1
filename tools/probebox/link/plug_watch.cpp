#include "tools/probebox/link/plug_watch.hpp"

#include <algorithm>
#include <map>
#include <poll.h>
#include <set>
#include <string>

#include "drivers/io/rendezvous.hpp"
#include "drivers/usb_host/hot_plug.hpp"
#include "tools/link/wait.hpp"
#include "tools/probebox/link/on_usb.hpp"

namespace probebox::command {
namespace {

// Rights and other programs' claims change without an event, and so do announcements.
constexpr Nanoseconds kLookPeriod{500'000'000};
constexpr int kSliceMs = 50;

class PlugWatch {
 public:
  PlugWatch(const Until& until, Console& console) : until_{until}, console_{console}, begin_{link::now()} {
    auto plug = usb_host::HotPlug::watch(usb::kLink);
    if (plug) {
      plug_ = std::move(plug).value();
    } else {
      console_.note("probebox: " + plug.error().what + "; only boxes that run on this computer are shown");
    }
  }

  ExitStatus run() {
    while (!over()) {
      lookAtPlugs();
      if (link::now() >= next_look_) {
        next_look_ = link::now() + kLookPeriod;
        lookAtStates();
        lookAtAnnouncements();
      }
      if (!over()) wait();
    }
    return console_.interrupted() ? ExitStatus::interrupted : ExitStatus::ok;
  }

 private:
  void lookAtPlugs() {
    if (!plug_) return;
    for (const auto& [kind, device] : plug_->poll()) {
      if (kind == usb_host::PlugEvent::Kind::left) {
        states_.erase(device.node);
        tell("left", device, std::nullopt);
      } else {
        const auto state = states_[device.node] = stateOf(device);
        tell("arrived", device, state);
      }
    }
  }

  void lookAtStates() {
    if (!plug_) return;
    for (const auto& device : plug_->there()) {
      const auto state = stateOf(device);
      auto& known = states_[device.node];
      if (known.access != state.access) tell("changed", device, state);
      known = state;
    }
  }

  void lookAtAnnouncements() {
    std::set<std::string> now;
    for (const auto& announcement : io::rendezvous::listed()) {
      std::ranges::copy_if(announcement.uris, std::inserter(now, now.end()),
                           [](const std::string& uri) { return !uri.starts_with("usb:"); });
    }
    for (const auto& uri : announced_) {
      if (!now.contains(uri)) tell("left", {{"uri", uri}}, uri);
    }
    for (const auto& uri : now) {
      if (!announced_.contains(uri)) tell("arrived", {{"uri", uri}}, uri + "  runs on this computer");
    }
    announced_ = std::move(now);
  }

  void tell(const char* event, const usb_host::Device& device, const std::optional<UsbState>& state) {
    std::string text = "usb:" + device.name() + "  " + device.product + " at " + device.path;
    if (!state) return tell(event, {{"uri", "usb:" + device.name()}, {"place", device.path}}, text);
    text += state->why.empty() ? ", free" : ", " + state->why + "; " + state->remedy;
    tell(event, describe(device, *state), text);
  }

  void tell(const char* event, const Json& about, const std::string& text) {
    if (over()) return;
    ++told_;
    if (console_.json()) {
      Json json{{"event", event}};
      json.update(about);
      console_.object(json);
    } else {
      console_.line(std::string{event} + std::string(9 - std::min<std::size_t>(std::string{event}.size(), 8), ' ') +
                    text);
    }
  }

  bool over() const {
    const bool time_is_over = until_.seconds && toSeconds(link::now() - begin_) >= *until_.seconds;
    return time_is_over || (until_.count && told_ >= *until_.count) || console_.interrupted() || !console_.writable();
  }

  void wait() const {
    pollfd watched{plug_ ? plug_->descriptor() : -1, POLLIN, 0};
    ::poll(&watched, 1, kSliceMs);
  }

  Until until_;
  Console& console_;
  MonoTime begin_;
  MonoTime next_look_{};
  std::unique_ptr<usb_host::HotPlug> plug_;
  std::map<std::string, UsbState> states_;  // by node
  std::set<std::string> announced_;
  std::uint64_t told_{};
};

}  // namespace

ExitStatus watchPlugs(const Until& until, Console& console) {
  return PlugWatch{until, console}.run();
}

}  // namespace probebox::command
