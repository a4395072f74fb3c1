// CLI11 is slow to compile: only this file and complaint.cpp include it.
#include "tools/probebox/cli/parse.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <sstream>

#include "tools/probebox/cli/complaint.hpp"
#include "tools/probebox/cli/validators.hpp"

namespace probebox::command {
namespace {

constexpr const char* kUriHelp =
    "the box: usb[:SERIAL], tcp:HOST:PORT, serial:DEVICE[,baud=RATE] or file:RECORDING.pbx; default: PROBEBOX_URI, or "
    "the only box that is found";
constexpr std::size_t kMostFrame = 2048;
constexpr const char* kUsualMethod = "delay-multi-speed";
constexpr const char* kAbout =
    "Shows the state of a probebox, records its samples, runs calibrations, and solves measured cases off line.\nExit "
    "status: 0 ok, 1 refused or failed measurement, 2 usage or unreadable input, 3 no box or link lost, 4 refused by "
    "the box, 130 interrupted, files closed, 141 the reader of a pipe has exited.";

// Every command with its options in one place; each adder says what to run when its command was named.
class CommandLine {
 public:
  CommandLine() {
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
    addCalibrating();
  }

  CLI::App& app() { return app_; }
  const Request& request() const { return request_; }

 private:
  template <class Options>
  CLI::App* add(const std::string& name, const std::string& about, const std::string& example, Options& options) {
    auto* command = app_.add_subcommand(name, about);
    command->fallthrough();  // `probebox status --json` is `probebox --json status`
    command->footer("Every command accepts -u/--uri URI and --json.\nExample:\n  " + example);
    command->callback([this, &options] { request_.job = options; });
    return command;
  }

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

  static void addProfile(CLI::App* command, std::string& profile) {
    command
        ->add_option("--profile", profile,
                     "coding of the samples: raw, or fast, which needs about a seventh of the bytes")
        ->check(CLI::IsMember({"raw", "fast"}))
        ->capture_default_str();
  }

  static messages::Profile profileOf(const std::string& name) {
    return name == "raw" ? messages::Profile::raw : messages::Profile::fast;
  }

  static void addPatience(CLI::App* command, double& patience_s) {
    command->add_option("--patience", patience_s, "seconds to wait for a box that was unplugged or restarted")
        ->check(seconds())
        ->type_name("SECONDS")
        ->capture_default_str();
  }

  void addLooking() {
    auto* list = add("list", "list the boxes that can be reached from this computer", "probebox list", list_);
    list->add_option("--timeout", list_.timeout_s, "seconds to wait for each box's answer")
        ->check(seconds())
        ->type_name("SECONDS")
        ->capture_default_str();
    auto* list_watch = list->add_flag("--watch", list_.watch,
                                      "keep running and print one line for each box that appears or disappears");
    addUntil(list, list_.until, list_watch);
    add("info", "show the identity of the box: board, serial number, machine, channels", "probebox info --json", info_);
    add("status", "show the state of the box: clock, losses, calibration, newest results", "probebox status", status_);
    auto* watch = add("watch", "show clock, losses, positions and deflections live", "probebox watch --for 10", watch_);
    addUntil(watch, watch_.until);
    addPatience(watch, watch_.patience_s);
    addProfile(watch, watch_profile_);
    watch->callback([this] {
      watch_.profile = profileOf(watch_profile_);
      request_.job = watch_;
    });
    auto* corrections =
        add("corrections", "show the corrections that a CNC reads now", "probebox corrections --follow", corrections_);
    corrections->add_flag("--follow", corrections_.follow, "print one line for each update");
    corrections->add_option("--sum", corrections_.sum,
                            "first set the sources to sum, such as screw,centreline, or none");
    corrections->add_option(
        "--tell", corrections_.tell,
        "first send the angles (degrees), the tool number and its length (mm) to the box: B=30,tool=4,length=120");
    addUntil(corrections, corrections_.until);
  }

  void addRecording() {
    auto* record = add("record", "write all samples to a file and account for every lost one",
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
    addProfile(record, record_profile_);
    record->add_flag("--force", record_.force, "overwrite an existing file");
    record->callback([this] {
      record_.live = policy_ == "live";
      record_.profile = profileOf(record_profile_);
      request_.job = record_;
    });
    auto* exporting =
        add("export",
            "convert a recording to a table: CSV, or NumPy if the name ends with .npy; column names contain units",
            "probebox export scan.pbx -o scan.csv", export_);
    exporting->add_option("recording", export_.input,
                          "the recording; - is the standard input; default: the recording of -u file:");
    exporting->add_option("-o,--output", export_.output, "the table to write; - is the standard output")->required();
    exporting->add_flag("--force", export_.force, "overwrite an existing file");
    exporting
        ->add_option("--triggers", export_.triggers,
                     "also write a table of the triggers: CSV, or NumPy if the name ends with .npy")
        ->type_name("FILE");
  }

  // Off-line doors to what the box does: files in, files out.
  void addTables() {
    auto* verify =
        add("verify", "check a recording: frames, sequence numbers and the sample balance of every heartbeat",
            "probebox -u file:scan.pbx verify", verify_);
    verify->add_option("recording", verify_.input,
                       "the recording; - is the standard input; default: the recording of -u file:");
    auto* replay = add("replay", "serve a recording over TCP as if it were the box",
                       "probebox replay scan.pbx --speed max", replay_);
    replay->add_option("recording", replay_.input, "the recording")->required();
    replay->add_option("--listen", replay_.listen, "where to listen; port 0 takes a free one")
        ->type_name("HOST:PORT")
        ->capture_default_str();
    replay->add_option("--speed", replay_speed_, "multiple of the recorded speed, or max: as fast as hosts read")
        ->check(speed())
        ->type_name("NUMBER|max")
        ->capture_default_str();
    replay->add_flag("--once", replay_.once, "exit when the hosts have received the whole recording");
    replay->callback([this] {
      replay_.speed = replay_speed_ == "max" ? 0 : std::strtod(replay_speed_.c_str(), nullptr);
      request_.job = replay_;
    });
    auto* pack = add("pack", "convert a table of integers (first column: sample, increasing) to a recording",
                     "probebox pack --profile fast scan.csv scan.pbx", pack_);
    addFiles(pack, pack_.input, "the table, CSV", pack_.output, "the recording to write", pack_.force);
    addProfile(pack, pack_profile_);
    pack->add_option("--frame", pack_.frame, "maximum number of samples per frame")
        ->check(CLI::Range(std::size_t{1}, kMostFrame))
        ->type_name("NUMBER")
        ->capture_default_str();
    pack->callback([this] {
      pack_.profile = profileOf(pack_profile_);
      request_.job = pack_;
    });
    auto* unpack = add("unpack", "convert a recording to a table of integers as they were recorded",
                       "probebox unpack scan.pbx scan.csv", unpack_);
    addFiles(unpack, unpack_.input, "the recording", unpack_.output, "the table to write, CSV", unpack_.force);
    auto* clock = add("clock", "assign a tick of the master clock to each edge of a table",
                      "probebox clock --period-ns 1000000 edges.csv verdicts.csv --ticks ticks.csv", clock_);
    addFiles(clock, clock_.input, "the table: column edge_ns and, if known, line_seqno", clock_.output,
             "one row per edge: edge, tick, flag", clock_.force);
    clock->add_option("--period-ns", clock_.period_ns, "nominal period of the master clock, ns")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
    clock->add_option("--ticks", clock_.ticks, "also write the time of each tick as estimated in real time");
  }

  static void addFiles(CLI::App* command, std::string& input, const std::string& in, std::string& output,
                       const std::string& out, bool& force) {
    command->add_option("input", input, in + "; - is the standard input")->required();
    command->add_option("output", output, out + "; - is the standard output")->required();
    command->add_flag("--force", force, "overwrite an existing file");
  }

  void addCalibrating() {
    add("selftest", "check a machine before its first calibration: axis senses, probe signs, clock, edge stamps",
        "probebox selftest", selftest_);
    auto* solve = add("solve", "solve measured cases; with --json one object per line, in the order given",
                      "probebox solve --json cases/delay-multi-speed/0000", solve_);
    solve->add_option("case", solve_.cases, "case folders: config.json and the tables of measurements");
    solve->add_flag("--methods", solve_.methods,
                    "instead list the methods, or explain the tables and keys of those named in the place of cases");
    solve->callback([this] {
      if (!solve_.methods && solve_.cases.empty()) throw CLI::RequiredError{"case"};
      request_.job = solve_;
    });
    auto* report = add("report", "write an HTML report of measured cases: values, U, budget, plots; it prints on A4",
                       "probebox report cases/delay-multi-speed/0000 -o delay.html", report_);
    report->add_option("input", report_.inputs, "case folders, or files that `probebox solve --json` wrote")
        ->required();
    report->add_option("-o,--output", report_.output, "the HTML to write; - is the standard output")->required();
    report->add_flag("--force", report_.force, "overwrite an existing file");
    auto* calibrate = add("calibrate", "run a calibration on the machine, step by step",
                          "probebox calibrate delay-multi-speed --save delay-today --accept --by Ada", calibrate_);
    calibrate->add_option(
        "method", calibrate_.method,
        "the method; default: delay-multi-speed. Also delay-known-sphere, delay-plates, delay-per-axis, "
        "delay-non-normal, delay-in-out, centreline, centreline-limited-access, centreline-by-steps, c-axis-alignment, "
        "spindle-offset-2x2, spindle-offset-four, periodic-check, rotary-axis-errors, table-pivot, swivel-error, "
        "head-pivot, a-axis-alignment, screw-calibration, tool-setter, tool-assembly, sensor-head-calibration");
    addRunChoices(calibrate, calibrate_);
    calibrate->add_option("--axis", calibrate_.axis, "axis of the screw, X, Y or Z; for screw-calibration")
        ->check(CLI::IsMember({"X", "Y", "Z"}, CLI::ignore_case))
        ->type_name("AXIS");
    calibrate->add_option("--turns", calibrate_.turns, "whole turns of the screw, 3 or more; for screw-calibration")
        ->check(positive())
        ->type_name("NUMBER");
    calibrate
        ->add_option("--tool", calibrate_.tool,
                     "number of the tool that is measured; for tool-setter and tool-assembly")
        ->check(positive())
        ->type_name("NUMBER");
    calibrate->add_flag(
        "--head", calibrate_.head,
        "measure with the sensor head instead of the probe, one position per ball; for rotary-axis-errors");
    calibrate->add_flag("--shank", calibrate_.shank,
                        "measure with tip and shank of one stylus instead of tools of several lengths; for "
                        "a-axis-alignment and swivel-error");
    calibrate->add_option("--save", calibrate_.save, "also save the measured data as a case folder");
    calibrate->add_flag("--accept", calibrate_.accept, "accept the result at once (needs --by)");
    calibrate->add_option("--by", calibrate_.by, "the name of the person who accepts")->check(personsName());
    calibrate->add_flag("--abort", calibrate_.abort, "abort the running calibration");
    calibrate->callback([this] {
      checkCalibrate(calibrate_);
      if (!calibrate_.abort && calibrate_.method.empty()) calibrate_.method = kUsualMethod;
      request_.job = calibrate_;
    });
    add("propose", "let the box solve a measured case and store the result for acceptance",
        "probebox propose cases/rotary-axis-errors/C", propose_)
        ->add_option("case", propose_.input, "a case folder: config.json and the tables of measurements")
        ->required();
    auto* accept = add("accept", "put a proposed result into force", "probebox accept 17 --by Ada", accept_);
    accept->add_option("id", accept_.id, "number of the result, from calibrate or status")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
    accept->add_option("--by", accept_.by, "the name of the person who accepts")->required()->check(personsName());
    addPlan();
    addGoingBack();
  }

  static void addRunChoices(CLI::App* command, RunChoices& choices) {
    command->add_option("--speed", choices.speeds_mm_s, "speeds of the touches, such as 10,20,40")
        ->delimiter(',')
        ->check(positive())
        ->type_name("MM_PER_S");
    command->add_option("--overtravel", choices.overtravel_mm, "travel into the surface after contact")
        ->check(positive())
        ->type_name("MM");
    command->add_option("--clearance", choices.clearance_mm, "distance from the surface before and after a touch")
        ->check(positive())
        ->type_name("MM");
    command
        ->add_option("--approach", choices.approach_deg,
                     "angle between approach and surface normal; for delay-non-normal")
        ->check(positive())
        ->type_name("DEGREES");
    command
        ->add_option("--angles", choices.angles,
                     "number of angles of C; for centreline, centreline-limited-access and rotary-axis-errors")
        ->check(positive())
        ->type_name("NUMBER");
    command
        ->add_option("--arc", choices.arc_deg,
                     "range of C; default: 360 for centreline and rotary-axis-errors, 80 for centreline-limited-access "
                     "and centreline-by-steps")
        ->check(positive())
        ->type_name("DEGREES");
    command
        ->add_option("--heights", choices.balls,
                     "number of balls at different heights; for c-axis-alignment and rotary-axis-errors")
        ->check(positive())
        ->type_name("NUMBER");
  }

  void addPlan() {
    auto* plan = add("plan", "forecast the uncertainty of a calibration, and find the best touches for a given time",
                     "probebox plan delay-multi-speed --time 60", plan_);
    plan->add_option("method", plan_.method, "a method that calibrate runs")->required();
    addRunChoices(plan, plan_);
    plan->add_option("--time", plan_.time_s, "time available: propose the most precise sets of touches for it")
        ->check(seconds())
        ->type_name("SECONDS");
    const auto add_positive = [&](const char* name, std::optional<double>& value, const char* what, const char* unit) {
      plan->add_option(name, value, what)->check(positive())->type_name(unit);
    };
    add_positive("--machine-rate", plan_.machine_rate_hz, "rate of the positions; default: 1000", "HZ");
    add_positive("--machine-noise", plan_.machine_noise_um, "noise of one position, k = 1; default: 0.5", "UM");
    add_positive("--probe-rate", plan_.probe_rate_hz, "rate of the deflections; default: 2000", "HZ");
    add_positive("--probe-noise", plan_.probe_noise_um, "noise of one channel, k = 1; default: 0.4", "UM");
    add_positive("--acceleration", plan_.acceleration_mm_s2, "acceleration of the machine; default: 10000",
                 "MM_PER_S2");
  }

  void addGoingBack() {
    auto* rollback =
        add("rollback", "return to the result that was in force before", "probebox rollback delay --by Ada", rollback_);
    rollback
        ->add_option(
            "what", rollback_.what,
            "the subject (delay, centreline, screw-x, ...), one of its methods, or the number of the result to retire")
        ->required();
    rollback->add_option("--by", rollback_.by, "the name of the person who does it")->required()->check(personsName());
    auto* history =
        add("history", "list every change of stored results, with person and time", "probebox history delay", history_);
    history->add_option("what", history_.what, "only one result (its number), one subject or one method");
    auto* inhibit =
        add("inhibit", "say that a cut is on or over, and who says so: no result comes into force meanwhile",
            "probebox inhibit on --by Ada", inhibit_);
    inhibit->add_option("what", inhibit_.what, "on or off; without it only who holds an inhibit is told")
        ->check(CLI::IsMember({"on", "off"}));
    inhibit->add_option("--by", inhibit_.by, "the person whose inhibit it is; without it this link's own");
    inhibit
        ->add_option("--door", inhibit_.door, "with off: end that one's inhibit, such as of a controller that is gone")
        ->needs("--by");
  }

  static void checkCalibrate(const Calibrate& options) {
    if (options.abort && !options.method.empty()) {
      throw CLI::ValidationError{"calibrate", "--abort ends the running calibration; do not name a method"};
    }
    if (options.accept && options.by.empty()) {
      throw CLI::ValidationError{"--accept", "needs the name of the person who accepts: --by NAME"};
    }
  }

  CLI::App app_{kAbout, "probebox"};
  Request request_;
  std::string policy_{"record"};
  std::string pack_profile_{"fast"};
  std::string record_profile_{"fast"};
  std::string watch_profile_{"fast"};
  List list_;
  Info info_;
  Status status_;
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
  Calibrate calibrate_;
  Plan plan_;
  Selftest selftest_;
  Propose propose_;
  Accept accept_;
  Rollback rollback_;
  History history_;
  Corrections corrections_;
  Inhibit inhibit_;
};

}  // namespace

std::variant<Request, Answer> parse(std::span<const std::string> arguments) {
  CommandLine line;
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

}  // namespace probebox::command
