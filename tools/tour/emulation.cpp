#include "tools/tour/emulation.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <random>
#include <regex>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"

namespace probebox::tour {
namespace {

std::string withValue(const std::string& toml, const std::string& key, const std::string& value) {
  return std::regex_replace(toml, std::regex{"(^|\n)" + key + " *=[^#\n]*"}, "$1" + key + " = " + value + " ",
                            std::regex_constants::format_first_only);
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.7f", value);
  return text.data();
}

// The first such key stands in [encoders], the second in [probe].
std::string withDropouts(std::string toml, const std::string& encoders, const std::string& probe) {
  const std::string key = "dropout_probability";
  const auto first = toml.find(key);
  const auto second = toml.find(key, first + key.size());
  const auto put = [&](std::size_t at, const std::string& value) {
    const auto end = toml.find_first_of("#\n", at);
    toml.replace(at, end - at, key + " = " + value + " ");
  };
  put(second, probe);
  put(first, encoders);
  return toml;
}

}  // namespace

Outcome<Truth> writeWorld(const std::filesystem::path& folder, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const double tau_machine_s = std::uniform_real_distribution{0.002, 0.008}(random);
  const double tau_probe_s = std::uniform_real_distribution{0.0001, 0.0006}(random);
  const std::string machine = number(tau_machine_s);

  std::string toml{board::simFile("world.toml")};
  toml = withValue(toml, "seed", std::to_string(seed % 1'000'000'000));
  toml = withValue(toml, "tau_machine_s", "[" + machine + ", " + machine + ", " + machine + "]");
  toml = withValue(toml, "tau_probe_s", number(tau_probe_s));
  toml = withDropouts(std::move(toml), "0.002", "0.02");
  std::ofstream{folder / "world.toml"} << toml;

  const auto world = board::parseWorld(toml, (folder / "world.toml").string());
  if (!world) return world.error();
  return Truth{
      .tau_s = world->delays.tau_machine_s[0] - world->delays.tau_probe_s,
      .effective_diameter_mm = 2 * (world->sphere.radius_mm + world->sphere.stylus_ball_radius_mm),
      .drift_ppm = world->clock.drift_ppm,
  };
}

}  // namespace probebox::tour
