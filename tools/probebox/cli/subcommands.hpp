#pragma once
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <string>

#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/validators.hpp"

namespace probebox::command {

// Declares commands with help and an example each. CLI11 is slow to compile: only parse.cpp includes this.
class Subcommands {
 public:
  Subcommands(CLI::App& app, Request& request) : app_{app}, request_{request} {}

  // When this command is named, its parsed options become the request.
  template <class Options>
  CLI::App* add(const std::string& name, const std::string& about, const std::string& example, Options& options) {
    auto* command = app_.add_subcommand(name, about);
    command->fallthrough();  // `probebox status --json` is `probebox --json status`
    command->footer("Every command accepts -u/--uri URI and --json.\nExample:\n  " + example);
    command->callback([this, &options] { request_.job = options; });
    return command;
  }
  Request& request() { return request_; }

 private:
  CLI::App& app_;
  Request& request_;
};

// A box that is reached by TLS knows who asks; all others have to be told.
inline void checkPerson(const Request& request, const std::string& by, const char* option) {
  const char* environment = std::getenv("PROBEBOX_URI");
  const std::string uri = request.uri.empty() && environment != nullptr ? environment : request.uri;
  if (by.empty() && !uri.starts_with("tls:"))
    throw CLI::ValidationError{option, "needs the name of the person: --by NAME"};
}

inline void addPatience(CLI::App* command, double& patience_s) {
  command->add_option("--patience", patience_s, "seconds to wait for a box that was unplugged or restarted")
      ->check(seconds())
      ->type_name("SECONDS")
      ->capture_default_str();
}

}  // namespace probebox::command
