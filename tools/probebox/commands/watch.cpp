#include <algorithm>
#include <optional>
#include <vector>

#include "tools/link/recording.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/pace.hpp"
#include "tools/probebox/commands/watch_screen.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/tables/scale.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kPeriod{200};
constexpr milliseconds kFirstValues{1000};  // a box without a clock has none, and is shown as it is
constexpr int kMostDecimals = 4;            // a line has to hold all channels

// The newest of everything that the box sends.
struct Latest : link::StreamListener {
  // A block may belong to an earlier descriptor than the latest.
  void onBlock(const link::DecodedBlock& block) override {
    channels = block.descriptor.channels;
    values.clear();
    for (std::size_t channel = 0; channel < block.descriptor.channels.size(); ++channel) {
      values.push_back(Scale{block.descriptor.channels[channel].scale}.value(block.column(channel).back()));
    }
    sample = block.header.first + (block.header.count - 1);
  }
  void onTrigger(const messages::Trigger& trigger) override {
    triggers.push_back(trigger);
    newest_trigger = trigger.number;
  }
  void onHeartbeat(const messages::Heartbeat& b, const std::optional<link::Balance>& newest) override {
    beat = b;
    balanced = newest.has_value();
  }

  std::vector<messages::ChannelDescription> channels;  // of the values
  std::vector<double> values;                          // scaled
  SampleIndex sample{};
  std::vector<messages::Trigger> triggers;  // not told yet
  std::uint32_t newest_trigger{};           // 0: none came
  std::optional<messages::Heartbeat> beat;
  bool balanced{};  // there was a ledger to compare with
  std::string procedure;
};

std::string key(const messages::ChannelDescription& channel) {
  return channel.unit.empty() ? channel.name : channel.name + "_" + channel.unit;
}

// reconnections: before now.
Json describe(const Latest& latest, const SampleTally& tally, std::uint64_t reconnections) {
  Json values = Json::object();
  for (std::size_t i = 0; i < latest.values.size(); ++i) values[key(latest.channels[i])] = latest.values[i];
  const auto& beat = *latest.beat;
  const auto sums = tally.sinceStart();
  return {{"uptime_ms", beat.uptime_ms},
          {"clock", {{"state", std::string{messages::nameOf(beat.clock_state)}}, {"sigma_ns", beat.clock_sigma_ns}}},
          {"ledger",
           {{"produced_samples", sums.produced},
            {"received_samples", sums.received},
            {"declared_lost_samples", sums.declaredLost()},
            {"lost_on_link_samples", sums.lost_on_link},
            {"balanced", tally.exactSinceStart()}}},
          {"reconnections", reconnections},
          {"box_restarts", tally.restarts()},
          {"sample", latest.sample.index},
          {"values", values},
          {"procedure", latest.procedure}};
}

// "  a 339 b 360 c 378 nm  x 120.0000 y 79.9995 z -100.0000 mm": one line has to hold them all.
std::string valuesOf(const Latest& latest) {
  const auto& channels = latest.channels;
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

const char* whyNotExact(const SampleTally& tally) {
  if (!tally.exactSinceStart()) return " (DOES NOT BALANCE)";
  return tally.restarts() > 0 ? " (since the box was restarted; before it unknown)" : "";
}

std::string line(const Latest& latest, const SampleTally& tally) {
  const auto& beat = *latest.beat;
  const auto sums = tally.sinceStart();
  std::string all = "clock " + std::string{messages::nameOf(beat.clock_state)} + " " + readableNs(beat.clock_sigma_ns);
  all += printed("  samples %llu = %llu received + %llu lost%s", static_cast<unsigned long long>(sums.produced),
                 static_cast<unsigned long long>(sums.received),
                 static_cast<unsigned long long>(sums.declaredLost() + sums.lost_on_link), whyNotExact(tally));
  all += valuesOf(latest);
  if (latest.newest_trigger != 0) all += "  trigger " + std::to_string(latest.newest_trigger);
  return latest.procedure.empty() ? all : all + "  " + latest.procedure;
}

// Each as an object of its own; a line has no room for them.
void tellOfTriggers(Latest& latest, Console& console) {
  for (const auto& trigger : latest.triggers) {
    if (!console.json()) break;
    Json object = command::describe(trigger);
    object["event"] = "trigger";
    console.object(object);
  }
  latest.triggers.clear();
}

std::string inWords(const messages::ProcedureStatus::Answer& p) {
  std::string all{messages::nameOf(p.state)};
  if (p.state == RunState::waiting || p.state == RunState::running) {
    all += " step " + std::to_string(p.step + 1) + " of " + std::to_string(p.steps);
  }
  return all;
}

// Keeps one question about the procedure on its way, without waiting for it.
class ProcedureWatch {
 public:
  void look(LastingStream& stream, std::string& into) {
    if (asked_ && asked_over_ == stream.reconnections()) {
      const auto answer = stream.box()->answered<messages::ProcedureStatus>(*asked_);
      if (!answer) return;
      if (*answer) into = inWords(**answer);
    }
    asked_ = stream.box()->ask<messages::ProcedureStatus>({});
    asked_over_ = stream.reconnections();
  }

 private:
  std::optional<std::uint32_t> asked_;
  std::uint64_t asked_over_{};  // which link
};

class Display {
 public:
  Display(const Watch& options, link::Uri uri, Console& console)
      : console_{console},
        stream_{std::move(uri),
                {.policy = messages::Policy::live,
                 .profile = options.profile,
                 .patience = inMilliseconds(options.patience_s),
                 .triggers = true},
                latest_,
                console},
        pace_{options.until, kPeriod} {}

  ExitStatus run() {
    if (const auto trouble = stream_.open()) return console_.fail(*trouble);
    without_values_from_ = link::now() + kFirstValues;
    while (!pace_.over() && !console_.interrupted() && console_.writable()) {
      if (!stream_.round()) return console_.fail(*stream_.trouble());
      tellOfTheLink();
      tellOfTriggers(latest_, console_);
      if (stream_.box() != nullptr && somethingToShow() && pace_.due()) show();
    }
    return console_.interrupted() ? ExitStatus::interrupted : ExitStatus::ok;
  }

 private:
  // People are told by the stream itself.
  void tellOfTheLink() {
    const bool up = stream_.box() != nullptr;
    if (up == up_) return;
    up_ = up;
    if (!console_.json()) return;
    if (up) {
      console_.object({{"event", "link-restored"}, {"reconnections", stream_.reconnections()}});
    } else {
      console_.object({{"event", "link-lost"}, {"what", stream_.loss()}});
    }
  }

  bool somethingToShow() const {
    if (!latest_.beat) return false;
    return (!latest_.values.empty() && latest_.balanced) || link::now() >= without_values_from_;
  }

  void show() {
    procedure_.look(stream_, latest_.procedure);
    if (console_.json()) {
      console_.object(describe(latest_, stream_.tally(), stream_.reconnections()));
    } else {
      console_.live(line(latest_, stream_.tally()));
    }
  }

  Console& console_;
  Latest latest_;
  LastingStream stream_;
  ProcedureWatch procedure_;
  Pace pace_;
  MonoTime without_values_from_{};
  bool up_{true};
};

// A recording as it would have been watched: an update for every heartbeat of it, as fast as it can be read.
class RecordedDisplay : private link::StreamListener {
 public:
  RecordedDisplay(const Watch& options, Console& console) : options_{options}, console_{console} {}

  ExitStatus run(const std::string& path) {
    const auto end = readThrough(path, *this, console_, {.enough = [this] { return over() || !console_.writable(); }});
    return end ? ExitStatus::ok : conclude(end.error(), console_);
  }

 private:
  void onWelcome(const messages::Welcome& welcome) override { tally_.link(welcome.boot_id); }
  void onBlock(const link::DecodedBlock& block) override {
    tally_.block(block.header.first, block.header.count);
    latest_.onBlock(block);
    time_ = codec::timeOf(block.header, latest_.sample);
    if (!began_) began_ = codec::timeOf(block.header, block.header.first);
  }
  void onGap(const messages::Gap& gap) override { tally_.gap(gap); }
  void onHole(const messages::Gap& hole) override { tally_.hole(hole); }
  void onTrigger(const messages::Trigger& trigger) override { latest_.onTrigger(trigger); }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    tally_.heartbeat(beat, balance);
    latest_.onHeartbeat(beat, balance);
    if (latest_.values.empty() || over() || console_.interrupted() || !console_.writable()) return;
    ++shown_;
    tellOfTriggers(latest_, console_);
    if (console_.json()) {
      console_.object(describe(latest_, tally_, tally_.reconnections()));
    } else {
      console_.live(line(latest_, tally_));
    }
  }
  bool over() const {
    const bool all = options_.until.count && shown_ >= *options_.until.count;
    return all || (options_.until.seconds && began_ && toSeconds(time_ - *began_) > *options_.until.seconds);
  }

  const Watch& options_;
  Console& console_;
  Latest latest_;
  SampleTally tally_;
  std::optional<MonoTime> began_;  // of the recorded samples
  MonoTime time_{};
  std::uint64_t shown_{};
};

}  // namespace

ExitStatus run(const Watch& options, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address))
    return RecordedDisplay{options, console}.run(file->path);
  if (!console.json() && console.outIsTerminal()) {
    if (auto screen = TerminalScreen::open()) return watchOnScreen(options, *uri, std::move(screen), console);
  }
  return Display{options, *uri, console}.run();
}

}  // namespace probebox::command
