#pragma once
#include <atomic>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/text/machine_verdict.hpp"
#include "tools/probebox/view/event_log.hpp"
#include "tools/probebox/view/live_feed.hpp"

namespace probebox::view {

using command::Console;
using command::Trouble;

// Runs the only link to the box in a thread of its own. Samples and state become events; page requests go through
// ask(). After a lost link it reconnects and reports that to the page.
class BoxConnection {
 public:
  using Answer = Outcome<std::string, Trouble>;
  using Question = std::function<Answer(link::Client&, Console&)>;

  BoxConnection(link::Uri uri, EventLog& events, const std::atomic<bool>& interrupted);
  ~BoxConnection();

  // Connects and starts the thread. Returns why that failed.
  std::optional<Trouble> open();
  // Runs `question` in the connection's thread and waits; nothing it refers to is used after the return. Trouble: the
  // link is down, or the box was busy for too long; the question is then never run.
  Answer ask(Question question);
  // The kept samples between two times, as LiveFeed::window.
  Answer window(std::int64_t from_ns, std::int64_t to_ns, std::size_t columns);
  // The descriptor as it was told last, for a page whose events begin.
  std::string about();

  // The verdict on the machine and the state of the link, likewise; "null" before the first.
  std::string machine();
  std::string linkState();

  // Reason why the link ended for good; nothing before that.
  std::optional<Trouble> trouble() const;

 private:
  struct Asked {
    std::uint64_t number{};
    Question question;
    std::promise<Answer> answer;
  };
  struct Listener : link::StreamListener {
    explicit Listener(BoxConnection& owner) : connection{owner} {}
    void onDescriptor(const messages::Descriptor& descriptor) override;
    void onBlock(const link::DecodedBlock& block) override;
    void onTrigger(const messages::Trigger& trigger) override;
    void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;
    BoxConnection& connection;
  };

  void run();
  bool answerOne();
  void tellLink();
  void tellState();
  void tellMachine(bool results_changed);

  EventLog& events_;
  std::istringstream nothing_;
  std::ostringstream notes_;
  std::atomic<bool> stopped_{false};
  Console console_;
  Listener listener_;
  command::LastingStream stream_;
  LiveFeed feed_;
  messages::Descriptor descriptor_;
  std::optional<messages::Heartbeat> beat_;
  std::optional<bool> link_up_;
  command::MachineKnown known_;
  std::string told_results_;  // which results the verdict is about, and over which link they were read
  MonoTime next_samples_{}, next_state_{};

  mutable std::mutex mutex_;  // guards what follows
  std::vector<Asked> asked_;
  std::uint64_t questions_{};
  std::string about_;
  std::string told_machine_, told_link_;
  std::optional<Trouble> trouble_;
  const std::atomic<bool>& interrupted_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace probebox::view
