// CLI11 is slow to compile: only this file and complaint.cpp include it.
#include "tools/probebox/cli/parse.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <sstream>

#include "tools/probebox/cli/complaint.hpp"
#include "tools/probebox/cli/result_commands.hpp"
#include "tools/probebox/cli/run_commands.hpp"
#include "tools/probebox/cli/subcommands.hpp"
#include "tools/probebox/cli/validators.hpp"
#include "tools/probebox/cli/vendor_commands.hpp"

namespace probebox::command {
namespace {

constexpr const char* kUriHelp =
    "the box: usb[:SERIAL], tcp:HOST:PORT, tls:HOST[:PORT] (with the keys in PROBEBOX_TLS or ~/.config/probebox), "
    "serial:DEVICE[,baud=RATE] or file:RECORDING.pbx; default: PROBEBOX_URI, or the only box that is found";
constexpr std::size_t kMostFrame = 2048;
constexpr const char* kAbout =
    "Shows the state of a probebox, records its samples, runs calibrations, and solves measured cases off line.\n"
    "Values after +/- are combined standard uncertainties u (k = 1, type B included).\nExit "
    "status: 0 ok, 1 refused or failed measurement, 2 usage or unreadable input, 3 no box or link lost, 4 refused by "
    "the box, 130 interrupted, files closed, 141 the reader of a pipe has exited.";

// Every command with its options in one place; each adder says what to run when its command was named.
class CommandLine {
 public:
  explicit CommandLine(const MethodHelp& methods) : runs_{methods} {
    app_.require_subcommand(1);
    app_.set_help_flag("-h,--help", "print this help and exit");
    app_.set_version_flag("-V,--version", "probebox " PROBEBOX_VERSION);
    app_.add_option("-u,--uri", request_.uri, kUriHelp);
    app_.add_flag("--json", request_.json, "print JSON, one object per line, with units in the keys");
    app_.footer(
        "Example:\n  probebox -u tcp:localhost:7627 status\n`probebox COMMAND --help` shows an example of each "
        "command.");
    addLooking();
    addRecording();
    addTables();
    addSolving();
    runs_.declare(commands_);
    results_.declare(commands_);
    vendor_.declare(commands_);
  }

  CLI::App& app() { return app_; }
  const Request& request() const { return request_; }

 private:
  // `only_with`: the flag that makes the command go on by itself, where it needs one.
  static void addUntil(CLI::App* command, Until& until, CLI::Option* only_with = nullptr) {
    auto* time = command->add_option("--for", until.seconds, "stop after this many seconds")
                     ->check(seconds())
                     ->type_name("SECONDS");
    auto* count = command->add_option("--count", until.count, "stop after this many updates")
                      ->check(wholeNumber())
                      ->type_name("NUMBER");
    for (auto* option : {time, count}) {
      if (only_with != nullptr) option->needs(only_with);
    }
  }

  static CLI::Option* addProfile(CLI::App* command, std::string& profile, std::vector<std::string> names) {
    return command
        ->add_option("--profile", profile,
                     "coding of the samples: raw; fast, which needs about a seventh of the bytes; tight, which needs "
                     "about a tenth and ten microseconds a sample")
        ->check(CLI::IsMember(std::move(names)))
        ->capture_default_str();
  }
  static void addProfileOfLink(CLI::App* command, std::string& profile) {
    auto* option = addProfile(command, profile, {"auto", "raw", "fast", "tight"});
    option->description(option->get_description() + "; auto: tight on a slow serial line, else fast");
  }

  static std::optional<messages::Profile> profileOf(const std::string& name) {
    for (const auto profile : {messages::Profile::raw, messages::Profile::fast, messages::Profile::tight}) {
      if (name == messages::nameOf(profile)) return profile;
    }
    return std::nullopt;
  }

  void addLooking() {
    auto* list = commands_.add("list", "list the boxes that can be reached from this computer", "probebox list", list_);
    list->add_option("--timeout", list_.timeout_s, "seconds to wait for each box's answer")
        ->check(seconds())
        ->type_name("SECONDS")
        ->capture_default_str();
    auto* list_watch = list->add_flag("--watch", list_.watch,
                                      "keep running and print one line for each box that appears or disappears");
    addUntil(list, list_.until, list_watch);
    commands_.add("info", "show the identity of the box: board, serial number, machine, channels",
                  "probebox info --json", info_);
    commands_.add("status", "show the state of the box: clock, losses, calibration, newest results", "probebox status",
                  status_);
    commands_
        .add("metrics",
             "write the state of the box and its results in force as text for Prometheus, for a timer beside "
             "node_exporter's textfile collector; the file is replaced as a whole",
             "probebox metrics -o /var/lib/prometheus/node-exporter/probebox.prom", metrics_)
        ->add_option("-o,--output", metrics_.output, "the file to write or replace; - is the standard output")
        ->check(fileName())
        ->capture_default_str();
    auto* watch =
        commands_.add("watch", "show clock, losses, positions and deflections live", "probebox watch --for 10", watch_);
    addUntil(watch, watch_.until);
    addPatience(watch, watch_.patience_s);
    addProfileOfLink(watch, watch_profile_);
    watch->callback([this] {
      watch_.profile = profileOf(watch_profile_);
      request_.job = watch_;
    });
    auto* view = commands_.add(
        "view", "show a page about the box in a browser on this computer: live, calibrate, results, tools",
        "probebox -u tcp:localhost:7627 view", view_);
    view->add_option("--cell", view_.cell,
                     "description of machine, fixture, workpiece and tools, for the pictures of tools")
        ->check(fileName())
        ->type_name("FILE");
    view->add_option("--port", view_.port, "where the page is served on 127.0.0.1; 0 takes a free port")
        ->check(wholeBetween(0, 65535))
        ->type_name("NUMBER")
        ->capture_default_str();
    auto* corrections = commands_.add("corrections", "show the corrections that a CNC reads now",
                                      "probebox corrections --follow", corrections_);
    corrections->add_flag("--follow", corrections_.follow, "print one line for each update");
    corrections->add_option("--sum", corrections_.sum,
                            "first set the sources to sum, such as screw,centreline, or none");
    corrections->add_option(
        "--tell", corrections_.tell,
        "first send the angles (degrees), the tool number and its length (mm) to the box: B=30,tool=4,length=120");
    addUntil(corrections, corrections_.until);
  }

  void addRecording() {
    auto* record = commands_.add("record", "write all samples to a file and account for every lost one",
                                 "probebox record -o scan.pbx --for 10", record_);
    record->add_option("-o,--output", record_.output, "the recording to write; - is the standard output")->required();
    record->add_option("--for", record_.seconds, "stop after this many seconds; default: at Ctrl-C")
        ->check(seconds())
        ->type_name("SECONDS");
    record
        ->add_option("--policy", policy_,
                     "what the box drops when the link is too slow: live drops the oldest frames, record the newest")
        ->check(CLI::IsMember({"live", "record"}))
        ->capture_default_str();
    addPatience(record, record_.patience_s);
    addProfileOfLink(record, record_profile_);
    auto* on_trigger = record->add_flag("--on-trigger", record_.on_trigger,
                                        "wait for a trigger and write only what was before and after it");
    const auto add_length = [&](const char* name, double& value_s, const char* help) {
      record->add_option(name, value_s, help)
          ->check(between(0, 600))
          ->type_name("SECONDS")
          ->needs(on_trigger)
          ->capture_default_str();
    };
    add_length("--before", record_.before_s, "with --on-trigger: seconds of history at least");
    add_length("--after", record_.after_s, "with --on-trigger: seconds that follow at least");
    record->add_flag("--force", record_.force, "overwrite an existing file");
    record->callback([this, record] {
      for (const auto* option : {"--policy", "--profile", "--patience"}) {
        if (record->count(option) > 0) record_.for_box = option;
      }
      record_.live = policy_ == "live";
      record_.profile = profileOf(record_profile_);
      request_.job = record_;
    });
    auto* exporting = commands_.add(
        "export",
        "convert a recording to a table: CSV; NumPy if the name ends with .npy; MCAP for Foxglove and PlotJuggler if "
        "it ends with .mcap; column names contain units",
        "probebox export scan.pbx -o scan.csv", export_);
    exporting
        ->add_option("recording", export_.input,
                     "the recording; - is the standard input; default: the recording of -u file:")
        ->check(anyName());
    exporting->add_option("-o,--output", export_.output, "the table to write; - is the standard output")->required();
    exporting->add_flag("--force", export_.force, "overwrite an existing file");
    exporting
        ->add_option("--triggers", export_.triggers,
                     "also write a table of the triggers: CSV, or NumPy if the name ends with .npy")
        ->check(fileName())
        ->type_name("FILE");
    exporting->add_flag(
        "--points", export_.points,
        "add columns: the centre of the tip and the point of the surface that it touches (machine "
        "position, mm, the system delay taken out), the normal of the surface, and standard deviations; "
        "a value that the recording cannot tell is empty, and the reason is printed");
    exporting
        ->add_option("--friction", export_.friction,
                     "with --points: largest coefficient of friction between ball and part, for the standard deviation "
                     "of a surface point while the tip rests; a tip dragged by more has none; default 0.2")
        ->check(between(0, 1));
  }

  // What the box does, off line: files in, files out.
  void addTables() {
    auto* verify =
        commands_.add("verify", "check a recording: frames, sequence numbers and the sample balance of every heartbeat",
                      "probebox -u file:scan.pbx verify", verify_);
    verify
        ->add_option("recording", verify_.input,
                     "the recording; - is the standard input; default: the recording of -u file:")
        ->check(anyName());
    auto* replay = commands_.add("replay", "serve a recording over TCP as if it were the box",
                                 "probebox replay scan.pbx --speed max", replay_);
    replay->add_option("recording", replay_.input, "the recording")->required()->check(anyName());
    replay->add_option("--listen", replay_.listen, "where to listen; port 0 takes a free one")
        ->type_name("HOST:PORT")
        ->capture_default_str();
    replay->add_option("--speed", replay_speed_, "multiple of the recorded speed, or max: as fast as hosts read")
        ->check(speed())
        ->type_name("NUMBER|max")
        ->capture_default_str();
    replay->add_flag("--once", replay_.once,
                     "exit when the recording has ended, and the hosts have received all of it and stopped");
    replay->callback([this] {
      replay_.speed = replay_speed_ == "max" ? 0 : std::strtod(replay_speed_.c_str(), nullptr);
      request_.job = replay_;
    });
    auto* pack = commands_.add("pack", "convert a table of integers (first column: sample, increasing) to a recording",
                               "probebox pack --profile fast scan.csv scan.pbx", pack_);
    addFiles(pack, pack_.input, "the table, CSV", pack_.output, "the recording to write", pack_.force);
    addProfile(pack, pack_profile_, {"raw", "fast", "tight"});
    pack->add_option("--frame", pack_.frame, "maximum number of samples per frame")
        ->check(CLI::Range(std::size_t{1}, kMostFrame))
        ->type_name("NUMBER")
        ->capture_default_str();
    pack->callback([this] {
      pack_.profile = *profileOf(pack_profile_);
      request_.job = pack_;
    });
    auto* unpack = commands_.add("unpack", "convert a recording to a table of integers as they were recorded",
                                 "probebox unpack scan.pbx scan.csv", unpack_);
    addFiles(unpack, unpack_.input, "the recording", unpack_.output, "the table to write, CSV", unpack_.force);
    auto* clock = commands_.add("clock", "assign a tick of the master clock to each edge of a table",
                                "probebox clock --period-ns 1000000 edges.csv verdicts.csv --ticks ticks.csv", clock_);
    addFiles(clock, clock_.input, "the table: column edge_ns and, if known, line_seqno", clock_.output,
             "one row per edge: edge, tick, flag", clock_.force);
    clock->add_option("--period-ns", clock_.period_ns, "nominal period of the master clock, ns")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
    clock->add_option("--ticks", clock_.ticks, "also write the time of each tick as estimated in real time")
        ->check(fileName())
        ->type_name("FILE");
  }

  static void addFiles(CLI::App* command, std::string& input, const std::string& in, std::string& output,
                       const std::string& out, bool& force) {
    command->add_option("input", input, in + "; - is the standard input")->required()->check(anyName());
    command->add_option("output", output, out + "; - is the standard output")->required();
    command->add_flag("--force", force, "overwrite an existing file");
  }

  void addSolving() {
    auto* solve = commands_.add(
        "solve", "solve measured cases: a table on a terminal, else one JSON object per line, in the order given",
        "probebox solve --json cases/delay-multi-speed/0000", solve_);
    solve->add_option("case", solve_.cases, "case folders: config.json and the tables of measurements")
        ->check(anyName());
    solve->add_flag("--methods", solve_.methods,
                    "list the methods instead, or explain the tables and keys of the methods named instead of cases");
    solve->add_flag("--text", solve_.text, "print the table for people even into a pipe or a file");
    solve->callback([this] {
      if (!solve_.methods && solve_.cases.empty()) throw CLI::RequiredError{"case"};
      request_.job = solve_;
    });
    auto* report = commands_.add(
        "report", "write an HTML report of stored results or measured cases: values, U, budget, plots; it prints on A4",
        "probebox report 17 -o delay.html", report_);
    report
        ->add_option("input", report_.inputs,
                     "numbers of results, subjects (the result in force), case folders, or files that `probebox solve "
                     "--json` wrote")
        ->required()
        ->check(anyName());
    report->add_option("-o,--output", report_.output, "the HTML to write; - is the standard output")->required();
    report->add_flag("--force", report_.force, "overwrite an existing file");
  }

  CLI::App app_{kAbout, "probebox"};
  Request request_;
  Subcommands commands_{app_, request_};
  RunCommands runs_;
  ResultCommands results_;
  VendorCommands vendor_;
  std::string policy_{"record"};
  std::string pack_profile_{"fast"};
  std::string record_profile_{"auto"};
  std::string watch_profile_{"auto"};
  List list_;
  Info info_;
  Status status_;
  Metrics metrics_;
  Watch watch_;
  Record record_;
  Export export_;
  Verify verify_;
  Replay replay_;
  std::string replay_speed_{"1"};
  Pack pack_;
  Unpack unpack_;
  Clock clock_;
  Solve solve_;
  Report report_;
  Corrections corrections_;
  View view_;
};

}  // namespace

std::variant<Request, Answer> parse(std::span<const std::string> arguments, const MethodHelp& methods) {
  CommandLine line{methods};
  try {
    line.app().parse(std::vector<std::string>{arguments.rbegin(), arguments.rend()});  // CLI11 takes them from the back
    return line.request();
  } catch (const CLI::Success& wanted) {
    std::ostringstream text, unused;
    line.app().exit(wanted, text, unused);
    return Answer{ExitStatus::ok, text.str()};
  } catch (const CLI::ParseError& error) {
    return Answer{ExitStatus::usage, complaint(line.app(), error)};
  }
}

void withCommandLine(const MethodHelp& methods, const std::function<void(const CLI::App&)>& look) {
  CommandLine line{methods};
  look(line.app());
}

}  // namespace probebox::command
