#include <algorithm>
#include <gtest/gtest.h>
#include <optional>
#include <string>

#include "board/describe/sim_files.hpp"
#include "firmware/app/wiring/box_config.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "firmware/procedure/described/machine_facts.hpp"

// What the descriptions' own check accepts, the core takes: whatever is refused is refused there, with file and line.
namespace probebox::app {
namespace {

// The emulated board with one file's text exchanged; nothing where it is refused.
std::optional<board::Descriptions> accepted(const board::Descriptions& sim, const char* file, const std::string& text) {
  const auto taken = [](auto& into, auto parsed) {
    if (parsed) into = *parsed;
    return parsed.ok();
  };
  auto all = sim;
  const std::string name{file};
  const bool good = name == "box.toml"       ? taken(all.box, board::parseBox(text, name))
                    : name == "machine.toml" ? taken(all.machine, board::parseMachine(text, name))
                    : name == "probe.toml"   ? taken(all.probe, board::parseProbe(text, name))
                                             : taken(all.service, board::parseService(text, name));
  if (!good) return std::nullopt;
  return all;
}

// All texts with one whole number or decimal number of the file exchanged for `value`.
template <class Each>
void withEveryNumber(const std::string& text, const std::string& value, Each each) {
  constexpr std::string_view kDigits = "0123456789", kNumber = "0123456789._+-";
  for (std::size_t line = 0; line < text.size(); line = text.find('\n', line) + 1) {
    const auto end = text.find('\n', line);
    const auto equals = text.find('=', line);
    // Numbers of texts, such as those of addresses, are not for the descriptions' check.
    if (equals > end || text[line] == '#' || text.find('"', equals) < end) continue;
    for (auto at = text.find_first_of(kDigits, equals); at < std::min(end, text.find('#', line));) {
      const auto begin = text[at - 1] == '-' ? at - 1 : at;
      const auto past = text.find_first_not_of(kNumber, at);
      each(std::string{text}.replace(begin, past - begin, value), text.substr(line, end - line));
      at = text.find_first_of(kDigits, past);
    }
  }
}

TEST(AcceptedDescriptions, AreOnesThatTheCoreTakes) {
  const auto sim = board::simDescriptions();
  ASSERT_TRUE(sim) << sim.error().what;
  std::size_t taken = 0;
  for (const auto* const file : {"box.toml", "machine.toml", "probe.toml", "service.toml"}) {
    for (const char* const value :
         {"0",       "1",        "-1",       "2",     "10",  "16",   "100",  "256", "1000", "4096", "100000",
          "1000000", "10000000", "0.000001", "0.001", "0.5", "-0.5", "-100", "300", "1e9",  "50000"}) {
      withEveryNumber(std::string{board::simFile(file)}, value, [&](const std::string& text, const std::string& line) {
        const auto all = accepted(*sim, file, text);
        if (!all) return;
        ++taken;
        const auto refused = validate(Options{}, *all);
        EXPECT_FALSE(refused) << file << ": " << line << " with " << value << ": " << refused->what;
        EXPECT_EQ(wireDescriptor(*all, "0").channels.size(), 7U);
        EXPECT_EQ(procedure::factsOf(*all).probe_tools.count, all->machine.probe_tools.size());
      });
    }
  }
  EXPECT_GT(taken, 500U);
}

}  // namespace
}  // namespace probebox::app
