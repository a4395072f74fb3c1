#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/stream/history.hpp"
#include "firmware/stream/session.hpp"
#include "tools/replay/recording.hpp"

namespace probebox::replay {

struct ReplayOptions {
  double speed{1};  // times the recorded pace; 0: as fast as hosts read
  bool once{};      // end when the recording has ended and the hosts have gone
  std::string name;
};

// Serves a recording as if it were a box: hosts connect, start, resume, and get samples, gaps, heartbeats and the
// status. The replay begins when the first host starts. Requests that would change a box are refused. One thread.
class ReplayBox {
 public:
  ReplayBox(std::unique_ptr<Recording> recording, tcp::Listener listener, const ReplayOptions& options);

  const tcp::Address& address() const { return listener_.address(); }
  // Runs one round: waits a few milliseconds for hosts, or not at all when there is more to send. False at the end.
  bool round();

  std::uint64_t samples() const { return samples_; }
  bool ended() const { return ended_; }

 private:
  struct Host {
    std::unique_ptr<io::BytePipe> pipe;
    std::unique_ptr<stream::Session> session;
    MonoTime since{};
    bool closed{};
  };

  void accept(MonoTime now);
  void serve(Host& host, MonoTime now);
  void answer(Host& host, const stream::PendingRequest& asked, MonoTime now);
  static void receive(Host& host, MonoTime now);
  static void transmit(Host& host);
  bool produce(MonoTime now);
  bool isDue(const Recorded& recorded, MonoTime now);
  void offer(const Recorded& recorded);
  void offer(const stream::EncodedBlock& block);
  bool somebodyListens() const;
  bool everybodyHasAll() const;
  void wait(bool briefly) const;
  std::uint64_t uptimeMs(MonoTime now) const;

  std::unique_ptr<Recording> recording_;
  tcp::Listener listener_;
  ReplayOptions options_;
  messages::BootId boot_id_{};
  MonoTime started_;
  stream::History history_;
  std::vector<Host> hosts_;
  std::uint32_t next_session_{1};
  std::optional<Recorded> next_;
  std::optional<MonoTime> began_;           // on this computer's clock
  std::optional<MonoTime> recorded_begin_;  // on the recording's
  TickMap map_{};
  messages::Descriptor descriptor_;
  std::uint64_t samples_{};
  std::uint64_t lost_{};
  bool had_hosts_{};
  bool ended_{};
};

}  // namespace probebox::replay
