#include <algorithm>
#include <optional>
#include <vector>

#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/pace.hpp"
#include "tools/probebox/report.hpp"
#include "tools/probebox/scale.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kPeriod{200};
constexpr milliseconds kFirstValues{1000};  // a box without a clock has none, and is shown as it is
constexpr int kMostDecimals = 4;            // a line has to hold all channels

// The newest of everything that the box sends.
struct Latest : link::StreamListener {
  void onDescriptor(const messages::Descriptor& d) override { descriptor = d; }
  void onBlock(const link::DecodedBlock& block) override {
    values.clear();
    for (std::size_t channel = 0; channel < block.descriptor.channels.size(); ++channel) {
      values.push_back(Scale{block.descriptor.channels[channel].scale}.value(block.column(channel).back()));
    }
    sample = block.header.first + (block.header.count - 1);
  }
  void onHeartbeat(const messages::Heartbeat& b, const std::optional<link::Balance>& newest) override {
    beat = b;
    balance = newest;
  }

  messages::Descriptor descriptor;
  std::vector<double> values;  // scaled, in the order of the channels
  SampleIndex sample{};
  std::optional<messages::Heartbeat> beat;
  std::optional<link::Balance> balance;
  std::string procedure;
};

std::string key(const messages::ChannelDescription& channel) {
  return channel.unit.empty() ? channel.name : channel.name + "_" + channel.unit;
}

Json describe(const Latest& latest) {
  Json values = Json::object();
  for (std::size_t i = 0; i < latest.values.size(); ++i) values[key(latest.descriptor.channels[i])] = latest.values[i];
  const auto& beat = *latest.beat;
  const auto account = latest.balance.value_or(link::Balance{.exact = true});
  return {{"uptime_ms", beat.uptime_ms},
          {"clock", {{"state", std::string{messages::nameOf(beat.clock_state)}}, {"sigma_ns", beat.clock_sigma_ns}}},
          {"ledger",
           {{"produced_samples", account.produced},
            {"received_samples", account.account.received},
            {"declared_lost_samples", account.account.declared_lost},
            {"lost_on_link_samples", account.account.inferred_lost},
            {"balanced", account.exact}}},
          {"sample", latest.sample.index},
          {"values", values},
          {"procedure", latest.procedure}};
}

// "  a 339 b 360 c 378 nm  x 120.0000 y 79.9995 z -100.0000 mm": one line has to hold them all.
std::string valuesOf(const Latest& latest) {
  const auto& channels = latest.descriptor.channels;
  std::string all;
  for (std::size_t i = 0; i < latest.values.size(); ++i) {
    const auto& [name, unit, scale, bytes, is_signed, doc] = channels[i];
    if (unit.empty()) continue;
    const bool first_of_unit = i == 0 || channels[i - 1].unit != unit;
    const bool last_of_unit = i + 1 == latest.values.size() || channels[i + 1].unit != unit;
    const int decimals = std::min(Scale{scale}.decimals().value_or(kMostDecimals), kMostDecimals);
    all +=
        (first_of_unit ? "  " : " ") + name.substr(name.rfind('_') + 1) + printed(" %.*f", decimals, latest.values[i]);
    if (last_of_unit) all += " " + unit;
  }
  return all;
}

std::string line(const Latest& latest) {
  const auto& beat = *latest.beat;
  const auto account = latest.balance.value_or(link::Balance{.exact = true});
  std::string all = "clock " + std::string{messages::nameOf(beat.clock_state)} + " " + readableNs(beat.clock_sigma_ns);
  all += printed("  samples %llu = %llu received + %llu lost%s", static_cast<unsigned long long>(account.produced),
                 static_cast<unsigned long long>(account.account.received),
                 static_cast<unsigned long long>(account.account.declared_lost + account.account.inferred_lost),
                 account.exact ? "" : " (DOES NOT BALANCE)");
  all += valuesOf(latest);
  return latest.procedure.empty() ? all : all + "  " + latest.procedure;
}

std::string inWords(const messages::ProcedureStatus::Answer& p) {
  std::string all{messages::nameOf(p.state)};
  if (p.state == messages::ProcedureState::waiting || p.state == messages::ProcedureState::running) {
    all += " step " + std::to_string(p.step + 1) + " of " + std::to_string(p.steps);
  }
  return all;
}

// Keeps one question about the procedure on its way, without waiting for it.
class ProcedureWatch {
 public:
  explicit ProcedureWatch(link::Client& box) : box_{box}, asked_{box.ask<messages::ProcedureStatus>({})} {}

  void look(std::string& into) {
    const auto answer = box_.answered<messages::ProcedureStatus>(asked_);
    if (!answer) return;
    if (*answer) into = inWords(**answer);
    asked_ = box_.ask<messages::ProcedureStatus>({});
  }

 private:
  link::Client& box_;
  std::uint32_t asked_;
};

}  // namespace

ExitStatus run(const Watch& options, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (uri->isFile()) return console.fail(usage("a recording does not change; see `probebox export`"));
  Latest latest;
  const auto opened = openBox(*uri, console, kConnectPatience, &latest);
  if (!opened) return console.fail(opened.error());
  link::Client& box = **opened;
  box.start({.policy = messages::Policy::live});
  ProcedureWatch procedure{box};
  Pace pace{options.until, kPeriod};
  const auto without_values_from = link::now() + kFirstValues;
  while (!pace.over() && goRound(box, console)) {
    if (!latest.beat || ((latest.values.empty() || !latest.balance) && link::now() < without_values_from)) continue;
    if (!pace.due()) continue;
    procedure.look(latest.procedure);
    if (console.json()) {
      console.object(describe(latest));
    } else {
      console.live(line(latest));
    }
  }
  return ended(box, console);
}

}  // namespace probebox::command
