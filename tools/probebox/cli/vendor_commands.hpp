#pragma once
#include <CLI/CLI.hpp>

#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/subcommands.hpp"
#include "tools/probebox/cli/validators.hpp"

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
    declareFactoryTest(commands);
  }

 private:
  void declareFactoryTest(Subcommands& commands) {
    auto* test =
        commands.add("factory-test",
                     "measure a box before it is shipped and write an HTML sheet: identity, clock, edge stamps, "
                     "losses at rate, link, memory; exit status 1 where a line fails",
                     "probebox -u usb factory-test -o PB-000123.html --by Ada", factory_test_);
    test->add_option("-o,--output", factory_test_.output, "the HTML to write; - is the standard output")->required();
    test->add_option("--for", factory_test_.seconds, "seconds for which samples and edges are counted")
        ->check(between(1, 3600))
        ->type_name("SECONDS")
        ->capture_default_str();
    test->add_option("--by", factory_test_.by, "the name of the person who tests")->check(personsName());
    test->add_flag("--force", factory_test_.force, "overwrite an existing file");
  }

  Provision provision_;
  FactoryTest factory_test_;
};

}  // namespace probebox::command
