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
    auto* provision = commands.add("provision",
                                   "write the identity of a box, once: serial number, USB numbers, calibrated sphere, "
                                   "refused where it has one; and "
                                   "the keys of its tls: links, as often as they are renewed",
                                   "probebox -u usb provision unit.toml", provision_);
    auto* file =
        provision->add_option("file", provision_.input, "unit.toml, as docs/vendor.md describes it")->check(anyName());
    provision
        ->add_option("--keys", provision_.keys,
                     "folder with box.crt, box.key and people.crt, as probebox-keys makes it")
        ->type_name("FOLDER")
        ->check(anyName());
    provision->add_flag("--check", provision_.check, "only check the file; needs no box")->needs(file);
    provision->callback([this, &commands] {
      if (provision_.input.empty() && provision_.keys.empty())
        throw CLI::ValidationError{"file", "is missing: name a unit.toml, or --keys FOLDER"};
      commands.request().job = provision_;
    });
    declareFactoryTest(commands);
    declareUpdate(commands);
  }

 private:
  void declareFactoryTest(Subcommands& commands) {
    auto* test = commands.add(
        "factory-test",
        "measure a box before it is shipped and write an HTML sheet: identity, clock, lines, encoders, edge stamps, "
        "losses at rate, link, controller, key of updates, memory; exit status 1 where a line fails",
        "probebox -u usb factory-test -o PB-000123.html --by Ada", factory_test_);
    test->add_option("-o,--output", factory_test_.output, "the HTML to write; - is the standard output")->required();
    test->add_option("--for", factory_test_.seconds, "seconds for which samples and edges are counted")
        ->check(between(1, 3600))
        ->type_name("SECONDS")
        ->capture_default_str();
    test->add_option(
            "--undriven", factory_test_.undriven,
            "a line of the sheet, such as 'line-skip' or 'encoder-position_x', that your fixture cannot drive: "
            "the sheet says so, and it fails nothing; repeat it for more")
        ->type_name("NAME");
    test->add_option("--by", factory_test_.by, "the name of the person who tests")->check(personsName());
    test->add_flag("--force", factory_test_.force, "overwrite an existing file");
  }

  void declareUpdate(Subcommands& commands) {
    auto* update = commands.add(
        "update", "install new firmware: send a bundle to the box, wait for its restart, and say what runs then",
        "probebox -u usb update mybox-arm64-1.4.raucb", update_);
    auto* bundle = update->add_option(
        "bundle", update_.bundle, "the bundle that tools/image made (.raucb); without it show how an update stands");
    bundle->check(anyName());
    auto* front_end =
        update
            ->add_option(
                "--front-end", update_.front_end,
                "the program of the front end on this computer (.uf2, by tools/front-end) in place of a bundle")
            ->check(anyName())
            ->excludes(bundle);
    update->add_option("--drive", update_.drive, "the folder where the front end's drive RPI-RP2 is mounted")
        ->check(anyName())
        ->needs(front_end);
    update->add_option("--receiver", update_.receiver, "the serial number of the front end, where there are two")
        ->check(anyName())
        ->needs(front_end);
    update->add_flag("--force", update_.force, "install it even if its version is not above the one that runs");
    update->add_flag("--no-wait", update_.no_wait, "exit when the box has the bundle")->excludes(front_end);
    addPatience(update, update_.patience_s);
  }

  Provision provision_;
  FactoryTest factory_test_;
  Update update_;
};

}  // namespace probebox::command
