#include "tools/tour/tour.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <random>
#include <regex>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "tools/case/readable.hpp"

namespace probebox::tour {
namespace {

// A description in which values are replaced, key after key, until one is not there.
class Description {
 public:
  explicit Description(std::string_view toml) : toml_{toml} {}

  // nth: 0 for the first line that begins with the key.
  void set(const std::string& key, const std::string& value, std::size_t nth = 0) {
    const std::regex line{"(^|\n)" + key + " *=[^#\n]*"};
    std::sregex_iterator found{toml_.begin(), toml_.end(), line};
    for (std::size_t k = 0; k < nth && found != std::sregex_iterator{}; ++k) ++found;
    if (found == std::sregex_iterator{}) {
      if (!missing_)
        missing_ = Error{"The emulated board's world.toml has no " + key + " number " + std::to_string(nth + 1) +
                         ": this tour and probeboxd are of different versions."};
      return;
    }
    const auto begin = static_cast<std::size_t>(found->position() + found->length(1));
    const auto size = static_cast<std::size_t>(found->length() - found->length(1));
    toml_.replace(begin, size, key + " = " + value + " ");
  }

  const std::string& toml() const { return toml_; }
  const std::optional<Error>& missing() const { return missing_; }

 private:
  std::string toml_;
  std::optional<Error> missing_;
};

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.7f", value);
  return text.data();
}

// Where the part's axis passes the first ball, as the machine's reference reads it with the stylus off its own spindle.
std::array<double, 2> centreOf(const board::World& world) {
  std::array<double, 2> centre{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& part = world.part_spindle;
    const double height_mm = part.balls_mm[0][2];
    centre[i] = part.point_mm[i] + part.direction[i] * height_mm - world.probe_spindle.stylus_offset_mm[i];
  }
  return centre;
}

}  // namespace

Outcome<Truth> writeWorld(const std::filesystem::path& folder, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const double tau_machine_s = std::uniform_real_distribution{0.002, 0.008}(random);
  const double tau_probe_s = std::uniform_real_distribution{0.0001, 0.0006}(random);
  const double axis_x_mm = std::uniform_real_distribution{329.9, 330.1}(random);
  const double axis_y_mm = std::uniform_real_distribution{199.9, 200.1}(random);
  const std::string machine = number(tau_machine_s);

  Description description{board::simFile("world.toml")};
  description.set("seed", std::to_string(seed % 1'000'000'000));
  description.set("tau_machine_s", "[" + machine + ", " + machine + ", " + machine + "]");
  description.set("tau_probe_s", number(tau_probe_s));
  description.set("point_mm", "[" + number(axis_x_mm) + ", " + number(axis_y_mm) + ", -300]");
  description.set("dropout_probability", "0.002");    // of the encoders
  description.set("dropout_probability", "0.02", 1);  // of the probe
  if (description.missing()) return *description.missing();
  std::ofstream{folder / "world.toml"} << description.toml();

  TRY(const auto world, board::parseWorld(description.toml(), (folder / "world.toml").string()));
  if (world.part_spindle.balls_mm.empty())
    return Error{
        "The emulated board's world.toml has no ball on the part: this tour and probeboxd are of different versions."};
  return Truth{
      .tau_s = world.delays.tau_machine_s[0] - world.delays.tau_probe_s,
      .effective_diameter_mm = 2 * (world.sphere.radius_mm + world.sphere.stylus_ball_radius_mm),
      .drift_ppm = world.clock.drift_ppm,
      .centre_mm = centreOf(world),
  };
}

void ClosingTable::estimate(const std::string& what, const messages::NamedValue& found, double truth) {
  constexpr double kMostSd = 4;
  const auto u = found.uncertainty();
  const bool judged = u && *u > 0;
  const double distance = judged ? std::abs(found.value - truth) / *u : HUGE_VAL;
  const auto label = casefolder::labelOf(found.key);
  std::array<char, 64> off{};
  std::snprintf(off.data(), off.size(), "; off by %.1f u", distance);
  rows_.push_back({what, casefolder::withUncertainty(label, found.value, judged ? u : std::nullopt),
                   "truth " + casefolder::withUncertainty(label, truth, std::nullopt) + off.data(),
                   distance <= kMostSd});
}

void ClosingTable::exact(const std::string& what, const std::string& found, bool right) {
  rows_.push_back({what, found, "exact", right});
}

bool ClosingTable::allRight() const {
  return !rows_.empty() && std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.right; });
}

void ClosingTable::print() const {
  int what_width = 0;
  int found_width = 0;
  for (const Row& row : rows_) {
    what_width = std::max(what_width, static_cast<int>(row.what.size()));
    found_width = std::max(found_width, static_cast<int>(row.found.size()));
  }
  for (const Row& row : rows_) {
    std::printf("  %-5s  %-*s  %-*s  %s\n", row.right ? "ok" : "WRONG", what_width, row.what.c_str(), found_width,
                row.found.c_str(), row.expected.c_str());
  }
}

}  // namespace probebox::tour
