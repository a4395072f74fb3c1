#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>

#include "board/describe/parse.hpp"
#include "host-tests/campaign/runner.hpp"

// bin/campaign: plays by the thousand, and what they found; or one play again.
namespace probebox::campaign {
namespace {

struct Options {
  double hours{1};
  double play_minutes{10};
  std::uint64_t seed{1};
  std::size_t jobs{std::max(1U, std::thread::hardware_concurrency())};
  std::size_t shrink_attempts{200};
  std::optional<Mixture> mixture;
  std::string world;
  std::string replay;
  std::string folder{"."};
};

constexpr int kExitFound = 1;
constexpr int kExitUsage = 2;

void tell(const std::string& line) {
  std::cout << line << '\n' << std::flush;
}

void showProgress(const Tally& tally, const Options& options, std::size_t found) {
  if (::isatty(STDERR_FILENO) == 0) return;
  std::cerr << "\r" << static_cast<int>(100 * tally.hours / options.hours) << " %, " << tally.hours << " of "
            << options.hours << " hours of box time, " << found << " found   " << std::flush;
}

void summarise(const Tally& tally, double real_hours) {
  tell("box time " + std::to_string(tally.hours) + " h in " + std::to_string(tally.plays) + " plays, " +
       std::to_string(tally.hours / real_hours) + " times as fast as real time");
  tell("restarts " + std::to_string(tally.restarts) + ", samples " + std::to_string(tally.samples) + " received and " +
       std::to_string(tally.lost_samples) + " declared lost");
  tell("registers read " + std::to_string(tally.reads) + " times, " + std::to_string(tally.valid_reads) +
       " of them valid; corrections held against the truth " + std::to_string(tally.checks_of_values) + " times");
  tell("runs solved " + std::to_string(tally.solved) + ", results proposed beside them " +
       std::to_string(tally.proposed) + ", accepted " + std::to_string(tally.accepted) + ", rolled back " +
       std::to_string(tally.rolled_back));
  std::string acts = "acts:";
  for (std::size_t i = 0; i < kKinds; ++i)
    acts += " " + std::string{name(static_cast<Kind>(i))} + " " + std::to_string(tally.acts.at(i));
  tell(acts);
}

void keep(const Runner::Done& found, const Options& options) {
  tell("seed " + std::to_string(found.play.seed) + ": " + found.verdict.violation->what + ", " +
       std::to_string(std::chrono::duration<double>{found.verdict.violation->at}.count()) + " s after the start");
  const auto small = shrink(found.play, found.verdict, options.shrink_attempts);
  const auto file = std::filesystem::path{options.folder} / ("play-" + std::to_string(found.play.seed) + ".json");
  std::ofstream{file} << toJson(small.play) << '\n';
  tell("  shrunk from " + std::to_string(found.play.acts.size()) + " acts to " +
       std::to_string(small.play.acts.size()) + " (" + small.verdict.violation->what + "); again: campaign --replay " +
       file.string());
}

int campaign(const Options& options) {
  const auto began = std::chrono::steady_clock::now();
  const Nanoseconds length{static_cast<std::int64_t>(options.play_minutes * 60e9)};
  const auto plays = static_cast<std::uint64_t>(std::ceil(options.hours * 60 / options.play_minutes));
  tell("seeds " + std::to_string(options.seed) + " to " + std::to_string(options.seed + plays - 1));
  Runner runner;
  Tally all;
  std::size_t found = 0;
  for (std::uint64_t started = 0; started < plays || runner.running() > 0;) {
    while (started < plays && runner.running() < options.jobs) {
      auto play = drawPlay(options.seed + started++, length, options.mixture);
      play.world = options.world;
      runner.start(std::move(play));
    }
    const auto done = runner.next();
    all += done.verdict.tally;
    if (done.verdict.violation) {
      ++found;
      keep(done, options);
    }
    showProgress(all, options, found);
  }
  const std::chrono::duration<double, std::ratio<3600>> real = std::chrono::steady_clock::now() - began;
  summarise(all, real.count());
  tell(found == 0 ? "no rule was broken" : std::to_string(found) + " plays broke a rule");
  return found == 0 ? 0 : kExitFound;
}

// Returns whether plays can be performed there; says why not.
bool isWorld(const std::string& folder) {
  const auto described = board::simDescriptions(folder);
  if (!described) std::cerr << described.error().what << '\n';
  return described.ok();
}

int replay(const std::string& file) {
  std::ifstream in{file};
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  const auto play = playFrom(text);
  if (!in.is_open() || !play) {
    std::cerr << file << ": " << (in.is_open() ? play.error().what : "cannot be read") << '\n';
    return kExitUsage;
  }
  if (!isWorld(play->world)) return kExitUsage;
  const auto verdict = perform(*play);
  summarise(verdict.tally, 1);
  if (!verdict.violation) {
    tell("no rule was broken");
    return 0;
  }
  tell(verdict.violation->what + ", " + std::to_string(std::chrono::duration<double>{verdict.violation->at}.count()) +
       " s after the start");
  return kExitFound;
}

}  // namespace
}  // namespace probebox::campaign

int main(int count, char** arguments) {
  using namespace probebox::campaign;
  Options options;
  CLI::App app{
      "Runs emulated boxes on virtual time with faults drawn at random, and checks the rules of docs/reliability.md.\n"
      "Example: campaign --hours 1000 --seed 1 --folder /tmp/found"};
  app.add_option("--hours", options.hours, "hours of box time")->check(CLI::Range(0.001, 1e6))->capture_default_str();
  app.add_option("--minutes", options.play_minutes, "minutes of one play")
      ->check(CLI::Range(0.1, 600.0))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the first play; the next ones count up")->capture_default_str();
  app.add_option("--jobs", options.jobs, "plays at a time")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--attempts", options.shrink_attempts, "to shorten a play that broke a rule")->capture_default_str();
  app.add_option("--folder", options.folder, "where plays that broke a rule are kept")
      ->check(CLI::ExistingDirectory)
      ->capture_default_str();
  std::string mixture;
  auto* mixed = app.add_option("--mixture", mixture,
                               "kinds of acts with weights, in place of a mixture drawn for each play: "
                               "kill=3,cut_power=1");
  double every_s = 0;
  auto* every =
      app.add_option("--every", every_s, "mean time between acts of --mixture, s; drawn for each play if not given")
          ->check(CLI::Range(0.1, 3600.0))
          ->needs(mixed);
  app.add_option("--world", options.world,
                 "a folder of descriptions in place of those of board/sim, such as board/sim-worn");
  app.add_option("--replay", options.replay, "one play again, from the file that was kept");
  CLI11_PARSE(app, count, arguments);
  if (*mixed) {
    const auto given = mixtureFrom(mixture);
    if (!given) {
      std::cerr << "--mixture: " << given.error().what << '\n';
      return kExitUsage;
    }
    options.mixture = *given;
    if (*every) options.mixture->mean_interval_s = every_s;
  }
  if (!isWorld(options.world)) return kExitUsage;
  if (!options.world.empty()) options.world = std::filesystem::absolute(options.world).string();
  return options.replay.empty() ? campaign(options) : replay(options.replay);
}
