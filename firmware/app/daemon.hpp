#pragma once
#include <memory>
#include <optional>
#include <string>

#include "board/describe/parse.hpp"
#include "firmware/app/options.hpp"
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
  // that cannot be had is said once and asked for while the box runs.
  static Outcome<std::unique_ptr<Daemon>> start(const Options& options, const board::Descriptions& descriptions);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // Where hosts can reach it, such as "tcp:127.0.0.1:7627".
  const std::vector<std::string>& uris() const;

 private:
  struct Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace probebox::app
