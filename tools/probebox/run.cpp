#include "tools/probebox/run.hpp"

#include <algorithm>
#include <ostream>

#include "tools/probebox/cli/parse.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/method_help.hpp"

namespace probebox::command {
namespace {

// A command has done its work only when its answer has arrived.
ExitStatus unlessUnheard(ExitStatus status, Console& console) {
  console.out().flush();
  return status == ExitStatus::ok && !console.writable() ? console.fail(outputGone()) : status;
}

ExitStatus answer(const Answer& answer, bool json, const Streams& streams) {
  Console console{streams, json};
  if (answer.status == ExitStatus::ok) {
    console.out() << answer.text << std::flush;
    return unlessUnheard(answer.status, console);
  }
  return console.fail({answer.status, "usage", answer.text});
}

}  // namespace

ExitStatus run(std::span<const std::string> arguments, const Streams& streams) {
  const auto parsed = parse(arguments, methodHelp());
  if (const auto* finished = std::get_if<Answer>(&parsed)) {
    // A command line that could not be parsed may still have asked for JSON.
    return answer(*finished, std::ranges::find(arguments, "--json") != arguments.end(), streams);
  }
  const auto& request = std::get<Request>(parsed);
  Console console{streams, request.json};
  const auto status = std::visit([&](const auto& options) { return run(options, request.uri, console); }, request.job);
  return unlessUnheard(status, console);
}

}  // namespace probebox::command
