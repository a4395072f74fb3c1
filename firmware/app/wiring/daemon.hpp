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

// Version for HELLO and --version.
std::string firmwareVersion();

// Reads the descriptions named by the options, strictly.
Outcome<board::Descriptions> loadDescriptions(const Options& options);

// Names the first option or description that this build cannot run, with the remedy; nullopt when there is none.
std::optional<Error> validate(const Options& options, const board::Descriptions& descriptions);

// Explains why nobody could come in through tls: links, by the file of their keys; nullopt where somebody can, or none
// is wanted. The daemon starts in any case: a certificate that has expired stops no machine.
std::optional<Error> whyNoDoor(const Options& options, const board::Descriptions& descriptions);

// The running box: all threads, from construction to destruction.
class Daemon {
 public:
  // Opens the store and the links; an error names the one that failed and the remedy. A missing source is logged once
  // and retried while the box runs. passed: TCP listeners opened by the service manager; their links are not opened
  // again.
  static Outcome<std::unique_ptr<Daemon>> start(const Options& options, const board::Descriptions& descriptions,
                                                std::vector<PassedSocket> passed = {});
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // Addresses for hosts, such as "tcp:127.0.0.1:7627".
  const std::vector<std::string>& uris() const;

  struct Condition {
    bool goes_on{};        // every stage of the chain has made progress since this was last true: feed the watchdog
    std::string in_words;  // for a person
  };
  // Call about every second from one thread. A stage without progress for longer than `patience` is logged at once,
  // independent of the worker.
  Condition condition(Nanoseconds patience);

 private:
  struct Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace probebox::app
