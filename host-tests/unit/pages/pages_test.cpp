#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "firmware/app/wiring/command_line.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "tools/pages/completion.hpp"
#include "tools/pages/described.hpp"
#include "tools/pages/man_page.hpp"
#include "tools/probebox/cli/parse.hpp"
#include "tools/probebox/method_help.hpp"

namespace probebox::pages {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const std::vector<std::string> kMethods{"delay-multi-speed", "delay-dwell"};

void withCommand(const std::function<void(const CLI::App&)>& look) {
  command::withCommandLine(command::methodHelp(), look);
}

// What bash offers behind `probebox WORDS...`.
std::string offered(const std::string& words) {
  const support::TemporaryFolder folder;
  const auto file = folder.file("probebox.bash");
  withCommand([&](const CLI::App& app) { std::ofstream{file} << bashCompletion(app, kMethods); });
  const std::string command = "bash -c '. " + file + "; COMP_WORDS=(probebox " + words +
                              "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); compopt() { :; }; _probebox; "
                              "printf \" %s\" \"${COMPREPLY[@]}\"; echo' 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe{popen(command.c_str(), "r"), pclose};
  std::string said;
  for (int c = fgetc(pipe.get()); c != EOF; c = fgetc(pipe.get())) said += static_cast<char>(c);
  return said;
}

TEST(ManPage, HasEveryCommandWithItsOptions) {
  withCommand([](const CLI::App& app) {
    const auto page = manPage(app, '1', "probebox", "a purpose");
    EXPECT_THAT(page, AllOf(HasSubstr(".TH PROBEBOX 1"), HasSubstr("probebox \\- a purpose")));
    ASSERT_GT(commandsOf(app).size(), 20U);
    for (const auto* command : commandsOf(app)) {
      const auto name = std::regex_replace(command->get_name(), std::regex{"-"}, "\\-");
      EXPECT_THAT(page, HasSubstr("\n.SS " + name));
    }
    EXPECT_THAT(page, HasSubstr("\\fB\\-\\-policy\\fR"));
  });
}

TEST(ManPage, HasAnExampleOfEveryCommand) {
  withCommand([](const CLI::App& app) {
    for (const auto* command : commandsOf(app))
      EXPECT_THAT(exampleOf(*command), AllOf(HasSubstr("probebox "), HasSubstr(command->get_name())));
  });
}

TEST(ManPage, IsOneOfTheDaemonToo) {
  CLI::App daemon;
  app::Options options;
  app::declareOptions(daemon, options);
  EXPECT_THAT(manPage(daemon, '8', "probeboxd", "a purpose"),
              AllOf(HasSubstr("\\-\\-init"), Not(HasSubstr(".SH COMMANDS"))));
}

TEST(ManPage, TakesNoLineOfTextForACommandOfRoff) {
  CLI::App app{"first\n.br of a text\n'and a quote \\ back"};
  EXPECT_THAT(manPage(app, '1', "x", "y"), HasSubstr("first\n\\&.br of a text\n\\&'and a quote \\e back"));
}

TEST(BashCompletion, OffersCommandsOptionsChoicesAndMethods) {
  EXPECT_EQ(offered("calib"), " calibrate\n");
  EXPECT_THAT(offered("record --f"), AllOf(HasSubstr("--for"), HasSubstr("--force")));
  EXPECT_EQ(offered("record --policy l"), " live\n");
  EXPECT_EQ(offered("--json calibrate delay-m"), " delay-multi-speed\n");
  EXPECT_EQ(offered("gcode delay-d"), " delay-dwell\n");
}

TEST(ZshCompletion, HasEveryCommandAndQuotesTheirTexts) {
  withCommand([](const CLI::App& app) {
    const auto page = zshCompletion(app, kMethods);
    for (const auto* command : commandsOf(app)) EXPECT_THAT(page, HasSubstr("\n      " + command->get_name() + ")\n"));
    EXPECT_THAT(page, HasSubstr("#compdef probebox"));
    EXPECT_THAT(page, HasSubstr("(raw fast tight)"));
  });
}

}  // namespace
}  // namespace probebox::pages
