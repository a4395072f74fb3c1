#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/subcommands.hpp"
#include "tools/probebox/cli/validators.hpp"

namespace probebox::command {

// Declares the commands about stored results, and about cuts and references, which decide when results take effect.
// Only parse.cpp includes this.
class ResultCommands {
 public:
  void declare(Subcommands& commands) {
    declareLooking(commands);
    declareChanging(commands);
    declareMachine(commands);
  }

 private:
  void declareLooking(Subcommands& commands) {
    commands
        .add("results", "list stored results: in force, waiting, proposed, retired, with values, person and time",
             "probebox results delay", results_)
        ->add_option("subject", results_.subject, "only one subject (delay, centreline, screw-x, ...) or one method")
        ->check(anyName());
    addId(commands.add("show", "show everything about one result: values with sd and U, fit, budget, history",
                       "probebox show 17", show_),
          show_.id);
    auto* certificate = commands.add(
        "certificate",
        "write a calibration certificate of a stored result: measured values, U and coverage, traceability, "
        "conditions, budget; it prints on A4",
        "probebox certificate 17 -o certificate-17.html --by Grace --next-due 2027-11-26", certificate_);
    addId(certificate, certificate_.id);
    certificate->add_option("-o,--output", certificate_.output, "the HTML (or XML) to write; - is the standard output")
        ->required();
    certificate->add_option("--by", certificate_.by, "the name of the person who issues it")->check(personsName());
    certificate
        ->add_option(
            "--next-due", certificate_.next_due,
            "when the calibration has to be repeated, as agreed; without it by [[requirement]] of machine.toml")
        ->check(day())
        ->type_name("DAY");
    auto* laboratory =
        certificate
            ->add_option("--laboratory", certificate_.laboratory,
                         "the laboratory's template: a file with name, email, city and country in [laboratory] and in "
                         "[customer], and what only people know in [calibration]")
            ->type_name("PARTIES.toml")
            ->check(anyName());
    certificate
        ->add_option("--dcc", certificate_.dcc,
                     "write a Digital Calibration Certificate of PTB, XML, in place of the page, with such a file")
        ->type_name("PARTIES.toml")
        ->check(anyName())
        ->excludes(laboratory);
    certificate->add_flag("--force", certificate_.force, "overwrite an existing file");
    commands
        .add("history", "list every change of stored results, with person and time", "probebox history delay", history_)
        ->add_option("what", history_.what, "only one result (its number), one subject or one method")
        ->check(anyName());
  }

  void declareChanging(Subcommands& commands) {
    auto* propose = commands.add("propose", "let the box solve a measured case and store the result for acceptance",
                                 "probebox propose cases/rotary-axis-errors/C", propose_);
    propose->add_option("case", propose_.input, "a case folder: config.json and the tables of measurements")
        ->required()
        ->check(anyName());
    auto* by = propose->add_option("--by", propose_.by, "with --as-this-machine: your name")->check(personsName());
    propose
        ->add_flag("--as-this-machine", propose_.as_this_machine,
                   "a case that names no probe, machine or mounting was measured with those of this box")
        ->needs(by);
    auto* accept = commands.add("accept", "show a proposed result beside the one in force, and put it into force",
                                "probebox accept 17 --by Ada", accept_);
    addId(accept, accept_.id);
    addPerson(accept, accept_.by, "the name of the person who accepts");
    accept->callback([this, &commands] {
      checkPerson(commands.request(), accept_.by, "accept");
      commands.request().job = accept_;
    });
    accept->add_flag("--although-it-differs", accept_.although_it_differs,
                     "accept it even if it differs from the result in force by more than 4 sd");
    auto* rollback = commands.add("rollback", "return to the result that was in force before",
                                  "probebox rollback delay --by Ada", rollback_);
    rollback
        ->add_option(
            "what", rollback_.what,
            "the subject (delay, centreline, screw-x, ...), one of its methods, or the number of the result to retire")
        ->required();
    addPerson(rollback, rollback_.by, "the name of the person who rolls back");
    rollback->callback([this, &commands] {
      checkPerson(commands.request(), rollback_.by, "rollback");
      commands.request().job = rollback_;
    });
  }

  void declareMachine(Subcommands& commands) {
    auto* home =
        commands.add("home", "tell the box the positions of axes after homing; for axes with reference = \"homing\"",
                     "probebox home X=0 Y=0 Z=-120.5", home_);
    home->add_option("axis", home_.axes, "axis and machine position in mm; the axis must have stood still for 0.1 s")
        ->required()
        ->check(axisPosition())
        ->type_name("AXIS=MM");
    home->add_option("--by", home_.by, "the name of the person who homed them, for the log")->check(personsName());
    auto* inhibit = commands.add("inhibit", "declare that a cut is on or over; no result comes into force during a cut",
                                 "probebox inhibit on --by Ada", inhibit_);
    inhibit->add_option("what", inhibit_.what, "on or off; without it only show who holds an inhibit")
        ->check(CLI::IsMember({"on", "off"}));
    inhibit->add_option("--by", inhibit_.by, "the person who holds the inhibit; default: this link")
        ->check(personsName());
    inhibit
        ->add_option("--connection", inhibit_.connection,
                     "with off: end the inhibit of this connection, such as a controller that is gone")
        ->check(anyName())
        ->needs("--by");
  }

  static void addId(CLI::App* command, std::uint64_t& id) {
    command->add_option("id", id, "number of the result, from probebox results")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
  }

  static void addPerson(CLI::App* command, std::string& by, const char* who) {
    command->add_option("--by", by, std::string{who} + "; not needed with tls:, where your certificate has it")
        ->check(personsName());
  }

  Results results_;
  Show show_;
  History history_;
  Certificate certificate_;
  Propose propose_;
  Accept accept_;
  Rollback rollback_;
  Home home_;
  Inhibit inhibit_;
};

}  // namespace probebox::command
