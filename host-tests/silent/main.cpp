#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "host-tests/silent/count.hpp"

// bin/silent-errors: counts, by method and error, answers that are wrong without a word.
namespace probebox::metrology::silent {
namespace {

struct Options {
  std::uint64_t cases{20}, seed{1};
  std::string method, error;
  bool json{};
};

std::string shown(const Cell& cell) {
  if (cell.cases == 0) return "-";
  return std::to_string(cell.silent) + " " + std::to_string(cell.off) + " " + std::to_string(cell.told) + " " +
         std::to_string(cell.named) + " " + std::to_string(cell.blamed);
}

int run(const Options& options) {
  auto list = nlohmann::json::array();
  const auto row = [&](const World& world) {
    if (!options.json) std::printf("%-32s", std::string{world.name}.c_str());
    for (const auto& error : errorKinds()) {
      if (!options.error.empty() && error.name != options.error && error.err != Err::none) continue;
      const Cell cell = count(world, error, options.cases, options.seed);
      if (!options.json) std::printf(" %-14s", shown(cell).c_str());
      std::fflush(stdout);
      list.push_back({{"method", world.name},
                      {"error", error.name},
                      {"cases", cell.cases},
                      {"off", cell.off},
                      {"silent", cell.silent},
                      {"told", cell.told},
                      {"refused", cell.refused},
                      {"named", cell.named},
                      {"blamed", cell.blamed},
                      {"words", cell.words}});
    }
    if (!options.json) std::printf("\n");
  };
  for (const auto worlds : {worldsOfTouches(), worldsOfPlaces()})
    for (const auto& world : worlds)
      if (world.name.find(options.method) != std::string_view::npos) row(world);
  if (options.json) std::cout << list.dump(1) << "\n";
  return 0;
}

}  // namespace
}  // namespace probebox::metrology::silent

int main(int argc, char** argv) {
  probebox::metrology::silent::Options options;
  CLI::App app{"Counts answers that are wrong without a warning, by method and by error of the machine."};
  app.add_option("--cases", options.cases, "simulated cases of each method and error");
  app.add_option("--seed", options.seed);
  app.add_option("--method", options.method, "methods with this in their name alone");
  app.add_option("--error", options.error, "cases without an error, and with this one, alone");
  app.add_flag("--json", options.json);
  CLI11_PARSE(app, argc, argv);
  return probebox::metrology::silent::run(options);
}
