#include <chrono>
#include <filesystem>
#include <thread>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/view/box_connection.hpp"
#include "tools/probebox/view/server.hpp"
#include "tools/replay/recorded_stream.hpp"
#include "tools/replay/replay_box.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;

// A recording as a box that listens here, at the recorded pace.
class Replayed {
 public:
  static Outcome<std::unique_ptr<Replayed>, Trouble> open(const std::string& path) {
    auto recording = replay::RecordedStream::open(path);
    if (!recording) return Trouble{ExitStatus::usage, "unreadable-recording", recording.error().what};
    auto listener = tcp::Listener::open({"127.0.0.1", 0});
    if (!listener) return usage(listener.error().what);
    return std::make_unique<Replayed>(std::move(recording).value(), std::move(listener).value(), path);
  }

  Replayed(std::unique_ptr<replay::RecordedStream> recording, tcp::Listener listener, const std::string& path)
      : box_{std::move(recording),
             std::move(listener),
             {.speed = 1, .once = false, .name = std::filesystem::path{path}.filename().string()}},
        uri_{"tcp:" + tcp::describe(box_.address())},
        thread_{[this](const std::stop_token& stop) {
          while (!stop.stop_requested() && box_.round()) {
          }
        }} {}

  const std::string& uri() const { return uri_; }

 private:
  replay::ReplayBox box_;
  std::string uri_;
  std::jthread thread_;
};

}  // namespace

ExitStatus run(const View& options, const std::string& given, Console& console) {
  auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  std::unique_ptr<Replayed> replayed;
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) {
    auto opened = Replayed::open(file->path);
    if (!opened) return console.fail(opened.error());
    replayed = std::move(opened).value();
    uri = chooseUri(replayed->uri());
    if (!uri) return console.fail(uri.error());
  }
  const auto cell = view::CellRequestHandler::open(options.cell, [&console] { return console.interrupted(); });
  if (!cell) return console.fail({ExitStatus::usage, "unreadable-input", cell.error().what});
  view::EventLog events;
  view::BoxConnection connection{*uri, events, console.interruption()};
  if (const auto trouble = connection.open()) return console.fail(*trouble);
  view::Server server{connection, *cell, events};
  const auto address = server.listen(options.port);
  if (!address)
    return console.fail(
        usage("port " + std::to_string(options.port) + " of 127.0.0.1 is taken; name another one, or 0"));
  if (console.json()) {
    console.object({{"address", *address}});
  } else {
    console.line("open " + *address);
    console.note("The address is for this computer and this run; Ctrl-C ends it.");
  }
  while (!console.interrupted() && console.writable() && !connection.trouble()) std::this_thread::sleep_for(100ms);
  if (const auto trouble = connection.trouble(); trouble && !console.interrupted()) return console.fail(*trouble);
  return console.interrupted() ? ExitStatus::interrupted : ExitStatus::ok;
}

}  // namespace probebox::command
