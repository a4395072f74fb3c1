#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/serial/settings.hpp"
#include "firmware/app/cnc/lasting_line.hpp"
#include "firmware/tape/report.hpp"
#include "firmware/tape/session.hpp"
#include "firmware/tape/text.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

struct TextOptions {
  enum class Format : std::uint8_t {
    records,  // one value per line, polled or streamed; each input is answered
    tape,     // a tape on request; input is answered only where `answers` says so
  };
  Format format{};
  serial::Address line;
  tape::Form form{};
  tape::Ask usual{tape::Ask::corrections};  // what a control gets that only starts its reader
  std::chrono::milliseconds every{};        // period of streamed records; 0: records are polled
  bool flow{};                              // XON and XOFF
  bool answers{};
};

// Reads the options of either format; nothing for a text that begins with neither:
// "records:DEVICE[,every=MS][,flow=yes|no][,baud=19200][,parity=even][,data=8][,stop=1]"
// "tape:DEVICE[,dialect=g10|macro|nv][,first=500][,offset=0][,reader=corrections|centreline|delay|all][,answers=yes|no]
//  [,flow=yes|no][,baud=9600][,parity=even][,data=7][,stop=2]"
std::optional<Outcome<TextOptions>> parseTextOptions(std::string_view text);

struct TextCounters {
  std::uint64_t answered{};  // lines taken
  std::uint64_t refused{};   // lines refused
  std::uint64_t sent{};      // records and tapes
  std::uint64_t unsent{};    // records and tapes that the line did not accept, or that were asked for again before
  std::uint64_t reopened{};
};

// Serves one text interface on one serial line in its own thread. A line that is closed is reopened, without limit.
class TextServer {
 public:
  // All of these are called on the thread of run().
  struct Callbacks {
    std::function<published::Snapshot()> snapshot;  // for the next record or tape
    // The text that goes out next has the correction of this snapshot.
    std::function<void(const published::Snapshot&)> serves;
    std::function<std::optional<Error>(const tape::Said&)> take;  // all of a line or nothing; returns why it refuses
    std::function<std::uint32_t()> run;                           // present run, for markers
    std::function<void(const std::string&)> report;       // the line was lost, or is back; a line that was refused
    std::function<void(const tape::Positions&)> reached;  // the control has reported positions
    std::function<void()> round{};
  };

  TextServer(TextOptions options, Callbacks callbacks);

  void run();
  void stop() { line_.stop(); }  // from any thread; run() returns at once

  TextCounters counters() const;
  std::uint64_t rounds() const { return line_.rounds(); }

 private:
  void serveOnce();
  void lost();
  void wait();
  void receive();
  void take(const tape::Session::Line& line);
  std::optional<tape::Refused> said(tape::Said events);
  void sendRecord();
  void show(tape::Ask ask);
  void answer(std::string text);
  using Due = std::variant<tape::Ask, std::string>;
  void enqueue(Due due);
  void makeNext();
  bool sending(std::chrono::steady_clock::time_point now) const;
  std::chrono::nanoseconds takes(std::size_t characters) const;
  void refuse(const tape::Refused& refused, std::string_view line);
  void hearItself();
  bool mayAnswerRefusal();
  void flush();

  const TextOptions options_;
  const Callbacks callbacks_;
  tape::Session session_;
  LastingLine line_;
  std::deque<Due> due_;
  std::size_t behind_end_{};                           // characters of the present text behind its last '%'
  std::chrono::steady_clock::time_point line_free_{};  // what was written has left the line; with flow alone
  std::chrono::steady_clock::time_point next_record_{};
  bool hears_itself_{};
  std::chrono::steady_clock::time_point refusals_since_{};  // the second in which refusals are counted
  int refusals_{};                                          // answered in it

  std::atomic<std::uint64_t> answered_{};
  std::atomic<std::uint64_t> refused_{};
  std::atomic<std::uint64_t> sent_{};
  std::atomic<std::uint64_t> unsent_{};
};

}  // namespace probebox::app
