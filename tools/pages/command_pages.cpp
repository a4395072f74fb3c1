// Writes the manual pages and completions from what --help prints: `command_pages NAME` prints the page of that name,
// which is probebox.1, probeboxd.8, probebox-fleet.8, probebox.bash or _probebox.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <vector>

#include "firmware/app/wiring/command_line.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "tools/fleet/options.hpp"
#include "tools/pages/completion.hpp"
#include "tools/pages/man_page.hpp"
#include "tools/probebox/cli/parse.hpp"
#include "tools/probebox/method_help.hpp"

namespace {

using namespace probebox;

std::vector<std::string> methods() {
  std::vector<std::string> names;
  for (const auto* method : procedure::liveMethods()) {
    if (method->calibrates) names.emplace_back(method->name());
  }
  return names;
}

// Empty where no page has this name.
std::string page(const std::string& name) {
  std::string text;
  if (name == "probeboxd.8") {
    CLI::App daemon;
    app::Options options;
    app::declareOptions(daemon, options);
    return pages::manPage(daemon, '8', "probeboxd", "daemon of the box between a scanning probe and a CNC controller");
  }
  if (name == "probebox-fleet.8") {
    CLI::App line;
    fleet::Options options;
    fleet::declareOptions(line, options);
    return pages::manPage(line, '8', "probebox-fleet", "a box towards Prometheus and MQTT");
  }
  command::withCommandLine(command::methodHelp(), [&](const CLI::App& line) {
    if (name == "probebox.1")
      text = pages::manPage(line, '1', "probebox",
                            "host command of the box between a scanning probe and a CNC controller");
    if (name == "probebox.bash") text = pages::bashCompletion(line, methods());
    if (name == "_probebox") text = pages::zshCompletion(line, methods());
  });
  return text;
}

}  // namespace

int main(int count, char** words) {
  const auto text = count == 2 ? page(words[1]) : std::string{};
  if (text.empty()) {
    std::cerr << "command_pages NAME: probebox.1, probeboxd.8, probebox-fleet.8, probebox.bash or _probebox\n";
    return 2;
  }
  std::cout << text << std::flush;
  return std::cout ? 0 : 1;
}
