#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "firmware/app/wiring/options.hpp"
#include "firmware/app/wiring/service_manager.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// The version that HELLO and --version tell.
std::string firmwareVersion();

// Reads the descriptions that the options name, strictly.
Outcome<board::Descriptions> loadDescriptions(const Options& options);

// Says what of the options or descriptions this build cannot run, and what to write instead; nothing when all is good.
std::optional<Error> whyRefused(const Options& options, const board::Descriptions& descriptions);

// The running box: all threads, from construction to destruction.
class Daemon {
 public:
  // Opens the store and the links; any of them that cannot be had at the start is an error with its remedy. A source
  // that cannot be had is said once and asked for while the box runs. `passed` are TCP listeners that others opened for
  // it; a link that one of them serves already is not opened again.
  static Outcome<std::unique_ptr<Daemon>> start(const Options& options, const board::Descriptions& descriptions,
                                                std::vector<PassedSocket> passed = {});
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // Where hosts can reach it, such as "tcp:127.0.0.1:7627".
  const std::vector<std::string>& uris() const;

  struct Condition {
    bool goes_on{};        // every stage of the chain has, since this was last so: feed the watchdog
    std::string in_words;  // for a person
  };
  // To be asked every second or so by one thread. A stage that stands still for longer than `patience` is named in the
  // log at once, whatever the worker does.
  Condition condition(Nanoseconds patience);

 private:
  struct Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace probebox::app
