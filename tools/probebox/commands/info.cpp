#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

ExitStatus show(const messages::Descriptor& descriptor, Console& console) {
  if (console.json()) {
    console.object(describe(descriptor));
  } else {
    console.line(page(descriptor));
  }
  return ExitStatus::ok;
}

struct FirstDescriptor : link::StreamListener {
  void onDescriptor(const messages::Descriptor& descriptor) override {
    if (!found) found = descriptor;
  }
  std::optional<messages::Descriptor> found;
};

ExitStatus ofRecording(const std::string& path, Console& console) {
  FirstDescriptor listener;
  const auto end = readThrough(path, listener, console, {.enough = [&] { return listener.found.has_value(); }});
  if (!end) return conclude(end.error(), console);
  if (listener.found) return show(*listener.found, console);
  return console.fail(
      {ExitStatus::usage, "no-descriptor", path + " does not identify its box: its beginning is cut off"});
}

}  // namespace

ExitStatus run(const Info&, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) return ofRecording(file->path, console);
  const auto box = openBox(*uri, console);
  if (!box) return console.fail(box.error());
  return show(*(*box)->reader().descriptor(), console);
}

}  // namespace probebox::command
