#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "host-tests/silent/count.hpp"

// bin/silent-errors: counts, by method and error, answers that are wrong without a word.
namespace probebox::metrology::silent {
namespace {

struct Options {
  std::uint64_t cases{20}, seed{1};
  std::string method, error;
  bool json{}, without_noise{};
};

// A column of the table.
struct ErrorColumn {
  std::string_view error;
  Draw draw;
};

std::vector<ErrorColumn> columnsOf(const Options& options) {
  std::vector<ErrorColumn> columns;
  for (const auto& error : errorKinds())
    if (options.error.empty() || error.name == options.error || error.err == Err::none)
      columns.push_back({error.name, each(error.err, !options.without_noise)});
  if (options.error.empty() || options.error == "mixed") columns.push_back({"mixed", mixed(!options.without_noise)});
  return columns;
}

std::string shown(const Cell& cell) {
  if (cell.cases == 0) return "-";
  return std::to_string(cell.silent) + " " + std::to_string(cell.off) + " " + std::to_string(cell.told) + " " +
         std::to_string(cell.named) + " " + std::to_string(cell.blamed);
}

nlohmann::json asJson(std::string_view method, std::string_view error, const Cell& cell) {
  return {{"method", method},      {"error", error},     {"cases", cell.cases},     {"off", cell.off},
          {"silent", cell.silent}, {"told", cell.told},  {"refused", cell.refused}, {"named", cell.named},
          {"blamed", cell.blamed}, {"words", cell.words}};
}

void printSums(const std::vector<ErrorColumn>& columns, const std::vector<Cell>& sums) {
  std::printf("\n%-16s %6s %6s %7s %6s %7s %7s\n", "error", "cases", "off", "silent", "told", "named", "blamed");
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Cell& sum = sums[k];
    std::printf("%-16s %6d %6d %7d %6d %7d %7d\n", std::string{columns[k].error}.c_str(), static_cast<int>(sum.cases),
                static_cast<int>(sum.off), static_cast<int>(sum.silent), static_cast<int>(sum.told),
                static_cast<int>(sum.named), static_cast<int>(sum.blamed));
  }
}

int run(const Options& options) {
  auto list = nlohmann::json::array();
  const auto columns = columnsOf(options);
  std::vector<Cell> sums(columns.size());
  if (!options.json) {
    std::printf("%-32s", "silent off told named blamed");
    for (const auto& column : columns) std::printf(" %-14s", std::string{column.error}.c_str());
    std::printf("\n");
  }
  for (const auto worlds : {worldsOfTouches(), worldsOfPlaces()}) {
    for (const auto& world : worlds) {
      if (world.name.find(options.method) == std::string_view::npos) continue;
      if (!options.json) std::printf("%-32s", std::string{world.name}.c_str());
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const Cell cell = count(world, columns[k].draw, options.cases, options.seed);
        sums[k].add(cell);
        if (!options.json) std::printf(" %-14s", shown(cell).c_str());
        std::fflush(stdout);
        list.push_back(asJson(world.name, columns[k].error, cell));
      }
      if (!options.json) std::printf("\n");
    }
  }
  if (options.json)
    std::cout << list.dump(1) << "\n";
  else
    printSums(columns, sums);
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
  app.add_flag("--without-noise", options.without_noise, "cases do not state the noise of their readings");
  app.add_flag("--json", options.json);
  CLI11_PARSE(app, argc, argv);
  return probebox::metrology::silent::run(options);
}
