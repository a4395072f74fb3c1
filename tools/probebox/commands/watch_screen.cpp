#include "tools/probebox/commands/watch_screen.hpp"

#include <limits>
#include <sstream>
#include <utility>

#include "tools/probebox/commands/pace.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/tables/scale.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kPicture{100};
constexpr milliseconds kAsking{200};
constexpr milliseconds kAfterFailure{1000};

// Keeps the state of the page from what the box sends.
struct Watched : link::StreamListener {
  void onDescriptor(const messages::Descriptor& descriptor) override {
    state.descriptor = descriptor;
    std::vector<WatchState::Channel> channels;
    for (const auto& channel : descriptor.channels) channels.push_back({channel.name, channel.unit, 0, {}});
    const bool same = channels.size() == state.channels.size() &&
                      std::equal(channels.begin(), channels.end(), state.channels.begin(),
                                 [](const auto& a, const auto& b) { return a.name == b.name; });
    if (!same) state.channels = std::move(channels);
  }
  void onBlock(const link::DecodedBlock& block) override {
    for (std::size_t c = 0; c < block.descriptor.channels.size() && c < state.channels.size(); ++c) {
      const Scale scale{block.descriptor.channels[c].scale};
      auto& channel = state.channels[c];
      const auto column = block.column(c);
      channel.value = scale.value(column.back());
      if (!channel.name.starts_with("deflection")) continue;
      for (std::size_t k = 0; k < column.size(); ++k) {
        const auto at = codec::timeOf(block.header, block.header.first + static_cast<std::int64_t>(k));
        channel.history.add(at, block.descriptor.channels[c].scale * static_cast<double>(column[k]));
      }
    }
    state.newest = codec::timeOf(block.header, block.header.first + (block.header.count - 1));
  }
  void onTrigger(const messages::Trigger& trigger) override { state.trigger = trigger; }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>&) override { state.beat = beat; }

  WatchState state;
};

// Keeps one question on its way, again some time after each answer.
template <class Operation>
class Asking {
 public:
  void look(LastingStream& stream, std::optional<typename Operation::Answer>& into,
            const typename Operation::Request& request = {}) {
    if (asked_ && over_ == stream.reconnections()) {
      auto answer = stream.box()->template answered<Operation>(*asked_);
      if (!answer) return;
      if (*answer) into = std::move(**answer);
      asked_.reset();
      next_ = link::now() + kAsking;
    }
    if (link::now() < next_ && over_ == stream.reconnections()) return;
    asked_ = stream.box()->template ask<Operation>(request);
    over_ = stream.reconnections();
  }

 private:
  std::optional<std::uint32_t> asked_;
  std::uint64_t over_{};  // which link
  MonoTime next_{};
};

class ScreenWatch {
 public:
  ScreenWatch(const Watch& options, const link::Uri& uri, TerminalScreen& screen, Console& console)
      : screen_{screen},
        console_{console},
        quiet_{Streams{console.in(), notes_, notes_, false, false, 0, console.interruption()}, false},
        stream_{uri,
                {.policy = messages::Policy::live,
                 .profile = options.profile,
                 .patience = inMilliseconds(options.patience_s),
                 .triggers = true},
                watched_,
                quiet_},
        pace_{options.until, kPicture} {}

  // Trouble: what ended it.
  std::optional<Trouble> run() {
    if (auto trouble = stream_.open()) return trouble;
    while (!pace_.over() && !console_.interrupted() && takeKeys()) {
      if (!stream_.round()) return stream_.trouble();
      ask();
      // A held picture ends with its link: an answer is not held beyond what it is about.
      const bool up = stream_.box() != nullptr;
      if (pace_.due() && (!held_ || up != watched_.state.link_up)) draw();
    }
    return std::nullopt;
  }

 private:
  // False when the person has had enough.
  bool takeKeys() {
    while (const auto key = screen_.key()) {
      if (*key == 'q') return false;
      if (*key == 'r') {
        for (auto& channel : watched_.state.channels) channel.history.clear();
      }
      if (*key == 'm') {
        watched_.state.machine_page = !watched_.state.machine_page;
        draw();
      }
      if (*key == ' ') {
        held_ = !held_;
        draw();
      }
    }
    return true;
  }

  void ask() {
    if (stream_.box() == nullptr) return;
    auto& state = watched_.state;
    corrections_.look(stream_, state.corrections);
    status_.look(stream_, state.status);
    procedure_.look(stream_, state.procedure);
    messages::ListResults::Request newest;
    newest.newest = 1;
    results_.look(stream_, newest_result_, newest);
    if (newest_result_ && !newest_result_->results.empty()) state.result = newest_result_->results.back();
    if (state.status && newest_result_) readResults(*state.status);
  }

  // Those about which the machine is judged, and the requirements: all of them, where there are other results than
  // before and after a reconnection, since a box that was started anew may have another machine.toml. Again some time
  // after a failure.
  void readResults(const messages::Status::Answer& status) {
    auto active = status.active_results;
    active.push_back(newest_result_->results.empty() ? 0 : newest_result_->results.back().id);
    active.push_back(stream_.reconnections());
    if (judged_ == active || link::now() < next_reading_ || stream_.box() == nullptr) return;
    next_reading_ = link::now() + kAfterFailure;
    auto results = storedResults(*stream_.box(), quiet_, {}, std::numeric_limits<std::size_t>::max());
    if (results) known_.results = std::move(*results);
    if (!results || stream_.box() == nullptr) return;
    auto machine = command::ask<messages::DescribeMachine>(*stream_.box(), quiet_);
    if (!machine) return;
    known_.requirements = std::move(machine->requirements);
    judged_ = std::move(active);
  }

  void draw() {
    auto& state = watched_.state;
    state.sums = stream_.tally().sinceStart();
    state.balanced = stream_.tally().exactSinceStart();
    state.restarts = stream_.tally().restarts();
    state.reconnections = stream_.reconnections();
    state.link_up = stream_.box() != nullptr;
    state.held = held_;
    known_.link_up = state.link_up;
    known_.status = state.status;
    known_.corrections = state.corrections;
    state.verdict = judge(known_);
    if (auto said = notes_.str(); !said.empty()) {
      while (!said.empty() && said.back() == '\n') said.pop_back();
      state.note = said.substr(said.rfind('\n') + 1);
      notes_.str("");
    }
    screen_.draw(watchPage(state, screen_.size(), screen_.utf8()));
  }

  TerminalScreen& screen_;
  Console& console_;
  std::ostringstream notes_;
  Console quiet_;  // what the stream says goes onto the page
  Watched watched_;
  LastingStream stream_;
  Pace pace_;
  bool held_{};
  Asking<messages::Corrections> corrections_;
  Asking<messages::Status> status_;
  Asking<messages::ProcedureStatus> procedure_;
  Asking<messages::ListResults> results_;
  std::optional<messages::ListResults::Answer> newest_result_;
  MachineKnown known_;
  std::vector<std::uint64_t> judged_;  // results in force, the newest one, and which link, as the verdict has them
  MonoTime next_reading_{};
};

}  // namespace

ExitStatus watchOnScreen(const Watch& options, const link::Uri& uri, std::unique_ptr<TerminalScreen> screen,
                         Console& console) {
  const auto trouble = ScreenWatch{options, uri, *screen, console}.run();
  screen.reset();  // what is said now stays on the terminal
  if (trouble) return console.fail(*trouble);
  return console.interrupted() ? ExitStatus::interrupted : ExitStatus::ok;
}

}  // namespace probebox::command
