#include "host-tests/campaign/act.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <random>
#include <system_error>

#include "host-tests/campaign/proposal.hpp"

namespace probebox::campaign {
namespace {

using namespace std::chrono_literals;

constexpr std::array<std::string_view, kKinds> kNames{
    "drop_probe",     "drop_encoders", "stop_sync",   "lose_edges",  "double_edges", "drop_drift",
    "stick_encoders", "freeze_probe",  "shake_probe", "jump_clock",  "drop_angles",  "replug_encoder",
    "overflow_queue", "stall_worker",  "fill_disk",   "unplug_line", "kill",         "cut_power",
    "lose_applied",   "stop",          "connect",     "cut_link",    "stop_reading", "propose",
    "start_run",      "abort_run",     "accept",      "roll_back",   "inhibit",      "end_inhibit",
    "home_outside",   "choose_sources"};

// Kinds that need others to mean anything: a run that is never started cannot be accepted.
constexpr std::array kUsual{Kind::start_run,   Kind::propose,        Kind::accept,
                            Kind::accept,      Kind::roll_back,      Kind::inhibit,
                            Kind::end_inhibit, Kind::choose_sources, Kind::choose_sources};

// Half of the worlds have the slowest clock that a box takes, so that most of the time goes into what happens and not
// into samples; the others are up to ten times as fast.
constexpr std::array<Nanoseconds, 16> kTicks{1ms,  2ms,  4ms,  4ms,  10ms, 10ms, 10ms, 10ms,
                                             10ms, 10ms, 10ms, 10ms, 10ms, 10ms, 10ms, 10ms};

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_{seed} {}

  std::uint64_t below(std::uint64_t end) { return std::uniform_int_distribution<std::uint64_t>{0, end - 1}(random_); }
  double uniform(double from, double to) { return std::uniform_real_distribution{from, to}(random_); }
  bool oneIn(std::uint64_t n) { return below(n) == 0; }
  // As many short times as long ones.
  Nanoseconds between(Nanoseconds from, Nanoseconds to) {
    const double logarithm =
        uniform(std::log(static_cast<double>(from.count())), std::log(static_cast<double>(to.count())));
    return Nanoseconds{std::llround(std::exp(logarithm))};
  }
  std::vector<double> exponential(std::size_t count) {
    std::vector<double> drawn(count);
    std::exponential_distribution<double> weight;
    for (auto& each : drawn) each = weight(random_);
    return drawn;
  }
  std::size_t pick(const std::vector<double>& weights) {
    return std::discrete_distribution<std::size_t>{weights.begin(), weights.end()}(random_);
  }

 private:
  std::mt19937_64 random_;
};

std::uint64_t numberOf(Kind kind, Dice& dice) {
  switch (kind) {
    case Kind::overflow_queue:
      return 1 + dice.below(20'000);
    case Kind::jump_clock:
      return dice.below(400'000);  // ns
    case Kind::cut_link:
      return dice.below(100'000);
    case Kind::start_run:
      return dice.below(1000);
    case Kind::replug_encoder:
    case Kind::inhibit:
    case Kind::end_inhibit:
    case Kind::home_outside:
      return dice.below(3);
    case Kind::choose_sources:
      return dice.oneIn(4) ? dice.below(16) : dice.below(2);  // often the screws, or nothing
    case Kind::propose:
      return dice.below(kProposals);
    case Kind::roll_back:
      return dice.below(10);
    case Kind::cut_power:
    case Kind::lose_applied:
      return dice.below(1U << 20U);
    default:
      return 0;
  }
}

// What chance alone seldom brings together: the correction walks, the disk does not follow, and the box ends.
void addScenes(Play& play, Dice& dice) {
  constexpr std::array kEnds{Kind::cut_power, Kind::cut_power, Kind::lose_applied, Kind::kill};
  constexpr Nanoseconds kEach = 150s;
  if (dice.oneIn(2)) return;
  for (auto left = play.length / kEach; left > 0; --left) {
    auto at = Nanoseconds{static_cast<std::int64_t>(dice.below(static_cast<std::uint64_t>(play.length.count())))};
    const auto add = [&](Kind kind, Nanoseconds lasts, std::uint64_t number) {
      play.acts.push_back({.kind = kind, .at = at, .lasts = lasts, .number = number});
      at += dice.between(1ms, 4s);
    };
    const auto lasts = dice.between(4s, 40s);
    constexpr std::array kTroubles{Kind::stall_worker, Kind::fill_disk, Kind::unplug_line};
    if (dice.oneIn(2)) add(kTroubles.at(dice.below(kTroubles.size())), lasts, 0);
    add(Kind::choose_sources, 0ns, dice.below(2));
    add(kEnds.at(dice.below(kEnds.size())), 0ns, dice.below(1U << 20U));
    if (dice.oneIn(3)) add(Kind::kill, 0ns, 0);
  }
}

}  // namespace

std::string_view name(Kind kind) {
  return kNames.at(static_cast<std::size_t>(kind));
}

Outcome<Mixture> mixtureFrom(std::string_view text) {
  Mixture mixture;
  for (bool more = true; more;) {
    const auto comma = text.find(',');
    const auto one = text.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);
    const auto equals = std::min(one.find('='), one.size());
    const auto kind = std::ranges::find(kNames, one.substr(0, equals));
    const auto rest = one.substr(std::min(equals + 1, one.size()));
    double weight = 0;
    const auto read = std::from_chars(rest.data(), rest.data() + rest.size(), weight);
    const bool whole = read.ec == std::errc{} && read.ptr == rest.data() + rest.size();
    if (kind == kNames.end() || !whole || !std::isfinite(weight) || weight <= 0) {
      std::string kinds;
      for (const auto each : kNames) kinds += (kinds.empty() ? "" : ", ") + std::string{each};
      return Error{"'" + std::string{one} + "' is no kind with a weight above 0, as in kill=3. Kinds: " + kinds + "."};
    }
    mixture.weights.at(static_cast<std::size_t>(kind - kNames.begin())) = weight;
  }
  return mixture;
}

Play drawPlay(std::uint64_t seed, Nanoseconds length, const std::optional<Mixture>& given) {
  Dice dice{seed};
  Play play{.seed = seed,
            .length = length,
            .tick = kTicks.at(dice.below(kTicks.size())),
            .poll_interval = 10ms * static_cast<std::int64_t>(1 + dice.below(20)),
            .absolute = dice.oneIn(2),
            .cold_um = dice.uniform(-250, 350),
            .acts = {}};
  auto weights = dice.exponential(kKinds);
  if (given) weights.assign(given->weights.begin(), given->weights.end());
  // From one act in two minutes to one a second.
  const double drawn_mean_s = dice.uniform(0, 1) < 0.1 ? 1 : dice.uniform(5, 120);
  const double mean_s = given ? given->mean_interval_s.value_or(drawn_mean_s) : drawn_mean_s;
  const auto expected = static_cast<std::uint64_t>(std::chrono::duration<double>{length}.count() / mean_s);
  std::size_t machine_faults = 0;
  for (std::uint64_t i = 0; i < expected; ++i) {
    const auto kind = dice.oneIn(3) ? kUsual.at(dice.below(kUsual.size())) : static_cast<Kind>(dice.pick(weights));
    constexpr std::size_t kMostMachineFaults = 60;  // that the emulated machine remembers
    if (static_cast<std::size_t>(kind) < kMachineKinds && ++machine_faults > kMostMachineFaults) continue;
    // Trouble comes in company: what one act begins the next one meets.
    const bool follows = !play.acts.empty() && dice.oneIn(2);
    const auto anywhen = Nanoseconds{static_cast<std::int64_t>(dice.below(static_cast<std::uint64_t>(length.count())))};
    play.acts.push_back({.kind = kind,
                         .at = follows ? play.acts.back().at + dice.between(1ms, 4s) : anywhen,
                         .lasts = dice.between(1ms, 40s),
                         .number = numberOf(kind, dice)});
  }
  if (!given) addScenes(play, dice);
  std::ranges::stable_sort(play.acts, {}, &Act::at);
  return play;
}

std::string toJson(const Play& play) {
  auto acts = nlohmann::json::array();
  for (const auto& act : play.acts) {
    acts.push_back(
        {{"kind", name(act.kind)}, {"at_ns", act.at.count()}, {"lasts_ns", act.lasts.count()}, {"number", act.number}});
  }
  return nlohmann::json{{"world", play.world},
                        {"seed", play.seed},
                        {"length_ns", play.length.count()},
                        {"tick_ns", play.tick.count()},
                        {"poll_interval_ns", play.poll_interval.count()},
                        {"absolute", play.absolute},
                        {"cold_um", play.cold_um},
                        {"acts", acts}}
      .dump(1);
}

Outcome<Play> playFrom(std::string_view json) {
  try {
    const auto read = nlohmann::json::parse(json);
    Play play{.world = read.value("world", ""),
              .seed = read.at("seed"),
              .length = Nanoseconds{read.at("length_ns").get<std::int64_t>()},
              .tick = Nanoseconds{read.at("tick_ns").get<std::int64_t>()},
              .poll_interval = Nanoseconds{read.at("poll_interval_ns").get<std::int64_t>()},
              .absolute = read.at("absolute"),
              .cold_um = read.at("cold_um"),
              .acts = {}};
    for (const auto& act : read.at("acts")) {
      const auto kind = std::ranges::find(kNames, act.at("kind").get<std::string>());
      if (kind == kNames.end()) return Error{"There is no act '" + act.at("kind").get<std::string>() + "'."};
      play.acts.push_back({.kind = static_cast<Kind>(kind - kNames.begin()),
                           .at = Nanoseconds{act.at("at_ns").get<std::int64_t>()},
                           .lasts = Nanoseconds{act.at("lasts_ns").get<std::int64_t>()},
                           .number = act.at("number")});
    }
    if (play.tick <= 0ns || play.poll_interval <= 0ns) return Error{"tick_ns and poll_interval_ns must be positive."};
    std::ranges::stable_sort(play.acts, {}, &Act::at);
    return play;
  } catch (const std::exception& problem) {
    return Error{std::string{"This is not a play: "} + problem.what()};
  }
}

}  // namespace probebox::campaign
