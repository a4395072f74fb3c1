#pragma once
#include <CLI/CLI.hpp>

#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/subcommands.hpp"

namespace probebox::command {

// Declares the commands of who builds and ships boxes. Only parse.cpp includes this.
class VendorCommands {
 public:
  void declare(Subcommands& commands) {
    auto* provision = commands.add(
        "provision",
        "write the identity of a box, once: serial number, USB numbers, calibrated sphere; refused where it has one",
        "probebox -u usb provision unit.toml", provision_);
    provision->add_option("file", provision_.input, "unit.toml, as docs/vendor.md describes it")->required();
    provision->add_flag("--check", provision_.check, "only check the file; needs no box");
  }

 private:
  Provision provision_;
};

}  // namespace probebox::command
