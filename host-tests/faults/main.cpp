#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <string>

#include "host-tests/faults/supervised.hpp"
#include "host-tests/faults/trial.hpp"

// bin/faults: every fault at every system call of a box's store room.
namespace probebox::faults {
namespace {

struct Options {
  std::size_t every{1};
  std::size_t from{1};
  std::string fault;
  bool verbose{};
};

struct Sum {
  std::size_t trials{};
  std::size_t calls{};
  std::size_t broken{};
};

void tell(const std::string& line) {
  std::cout << line << '\n' << std::flush;
}

Sum tryAll(Fault fault, Before before, const Options& options) {
  Sum sum;
  for (std::size_t call = options.from;; call += options.every) {
    const Trial trial{.fault = fault, .before = before, .call = call};
    const auto outcome = perform(trial);
    if (outcome.broken) {
      ++sum.broken;
      tell(describe(trial) + " (" + outcome.at + "): " + *outcome.broken);
    } else if (options.verbose) {
      tell(describe(trial) + " (" + outcome.at + "): " + std::to_string(outcome.changes) + " done, " +
           std::to_string(outcome.refused) + " refused");
    }
    if (!outcome.reached) break;
    sum.calls = call;
    sum.trials += outcome.applies ? 1U : 0U;
  }
  return sum;
}

int run(const Options& options) {
  if (const auto why = whyNoSupervision(); !why.empty()) {
    std::cerr << why << '\n';
    return 2;
  }
  std::size_t trials = 0, broken = 0;
  for (std::size_t i = 0; i < kFaults; ++i) {
    const auto fault = static_cast<Fault>(i);
    if (!options.fault.empty() && options.fault != name(fault)) continue;
    for (const auto before : {Before::nothing, Before::two_boots}) {
      const auto sum = tryAll(fault, before, options);
      tell(std::string{name(fault)} + ", " + std::string{name(before)} + ": " + std::to_string(sum.trials) +
           " trials at calls up to " + std::to_string(sum.calls) + ", " + std::to_string(sum.broken) + " broken");
      trials += sum.trials;
      broken += sum.broken;
    }
  }
  tell(std::to_string(trials) + " trials, " +
       (broken == 0 ? "no rule was broken" : std::to_string(broken) + " broken"));
  return broken == 0 ? 0 : 1;
}

}  // namespace
}  // namespace probebox::faults

int main(int count, char** arguments) {
  using namespace probebox::faults;
  Options options;
  CLI::App app{
      "Runs what a box keeps on its disk in a process of its own, with a fault at the n-th of its system calls on "
      "files,\n"
      "for n = 1, 2, ... until none is left, and checks after a restart that nothing acknowledged is lost and nothing "
      "is\n"
      "half done (docs/reliability.md). Example: faults --fault kill"};
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kFaults; ++i) names.emplace_back(name(static_cast<Fault>(i)));
  app.add_option("--fault", options.fault, "of this kind only")->check(CLI::IsMember(names));
  app.add_option("--from", options.from, "the first call")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_option("--every", options.every, "only every so many calls")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_flag("--verbose", options.verbose, "a line for each trial");
  CLI11_PARSE(app, count, arguments);
  return run(options);
}
