#include <filesystem>
#include <optional>
#include <unistd.h>

#include "drivers/io/rendezvous.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/replay/recorded_stream.hpp"
#include "tools/replay/replay_box.hpp"

namespace probebox::command {

ExitStatus run(const Replay& options, const std::string&, Console& console) {
  const auto address = tcp::parseAddress(options.listen);
  if (!address) return console.fail(usage("--listen: " + address.error().what));
  RecordingSums sums;
  auto recording = replay::RecordedStream::open(options.input, &sums);
  if (!recording) return console.fail({ExitStatus::usage, "unreadable-recording", recording.error().what});
  auto listener = tcp::Listener::open(*address);
  if (!listener) return console.fail(usage(listener.error().what));
  auto& stream = **recording;
  replay::ReplayBox box{
      std::move(recording).value(),
      std::move(listener).value(),
      {.speed = options.speed, .once = options.once, .name = std::filesystem::path{options.input}.filename().string()}};
  const std::string uri = "tcp:" + tcp::describe(box.address());
  if (const auto announced = io::rendezvous::announce(getpid(), {uri}); !announced)
    console.note("probebox: " + announced.error().what + " probebox list will not find this replay by itself.");
  if (console.json()) {
    console.object({{"uri", uri}, {"recording", options.input}});
  } else {
    console.line("serving " + options.input + " at " + uri + "; it begins when a host does; Ctrl-C ends it");
  }
  // What is missing looks like losses of the box to hosts.
  std::optional<ExitStatus> concluded;
  const auto conclude = [&] {
    if (box.ended() && !concluded)
      concluded = tellFaults(options.input, "what could be read of it was served", sums, stream.end(), console);
  };
  for (; !console.interrupted() && box.round(); conclude())
    console.progress(printed("%llu samples%s", static_cast<unsigned long long>(box.samples()),
                             box.ended() ? ", the recording is over" : ""));
  if (!console.interrupted()) conclude();
  io::rendezvous::withdraw(getpid());
  return console.interrupted() ? ExitStatus::interrupted : concluded.value_or(ExitStatus::ok);
}

}  // namespace probebox::command
