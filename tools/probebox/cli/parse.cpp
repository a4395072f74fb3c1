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
    "the box: usb[:SERIAL], tcp:HOST:PORT, serial:DEVICE[,baud=RATE] or file:RECORDING.pbx; without it "
    "PROBEBOX_URI, or the only box there is";
constexpr std::size_t kMostFrame = 2048;
constexpr const char* kUsualMethod = "delay-multi-speed";
constexpr const char* kAbout =
    "Looks at a probebox, records and calibrates with it, and solves measured cases without one.\n"
    "Exit status: 0 ok, 1 refused or measured fail, 2 usage or unreadable input, 3 no box or link lost, 4 the box "
    "refused, 130 interrupted with files closed.";

// Every command with its options in one place; each adder says what to run when its command was named.
class CommandLine {
 public:
  CommandLine() {
    app_.require_subcommand(1);
    app_.set_help_flag("-h,--help", "print this help and stop");
    app_.set_version_flag("-V,--version", "probebox " PROBEBOX_VERSION);
    app_.add_option("-u,--uri", request_.uri, kUriHelp);
    app_.add_flag("--json", request_.json, "answer in JSON, one object a line; units are in the keys");
    app_.footer("Example:\n  probebox -u tcp:localhost:7627 status\n`probebox COMMAND --help` has an example of each.");
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
    command->footer("-u/--uri URI and --json go with every command.\nExample:\n  " + example);
    command->callback([this, &options] { request_.job = options; });
    return command;
  }

  // `only_with`: the flag that makes the command go on by itself, where it needs one.
  static void addUntil(CLI::App* command, Until& until, CLI::Option* only_with = nullptr) {
    auto* time = command->add_option("--for", until.seconds, "stop after so many seconds")
                     ->check(seconds())
                     ->type_name("SECONDS");
    auto* count = command->add_option("--count", until.count, "stop after so many updates")
                      ->check(wholeNumber())
                      ->type_name("NUMBER");
    for (auto* option : {time, count}) {
      if (only_with != nullptr) option->needs(only_with);
    }
  }

  static void addProfile(CLI::App* command, std::string& profile) {
    command->add_option("--profile", profile, "how samples are coded: raw, or fast for about a seventh of the bytes")
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
    auto* list = add("list", "name the boxes that can be reached from here", "probebox list", list_);
    list->add_option("--timeout", list_.timeout_s, "seconds to wait for each box's answer")
        ->check(seconds())
        ->type_name("SECONDS")
        ->capture_default_str();
    auto* list_watch = list->add_flag("--watch", list_.watch, "go on, with one line for each box that comes or goes");
    addUntil(list, list_.until, list_watch);
    add("info", "what the box is: board, serial number, machine, channels", "probebox info --json", info_);
    add("status", "how the box is now: clock, losses, calibration, newest results", "probebox status", status_);
    auto* watch = add("watch", "follow clock, losses, positions and deflections as they change",
                      "probebox watch --for 10", watch_);
    addUntil(watch, watch_.until);
    addPatience(watch, watch_.patience_s);
    addProfile(watch, watch_profile_);
    watch->callback([this] {
      watch_.profile = profileOf(watch_profile_);
      request_.job = watch_;
    });
    auto* corrections =
        add("corrections", "the corrections that a CNC reads now", "probebox corrections --follow", corrections_);
    corrections->add_flag("--follow", corrections_.follow, "go on with one line for each update");
    corrections->add_option("--sum", corrections_.sum,
                            "first choose the sources that are summed, such as screw,centreline, or none");
    corrections->add_option(
        "--tell", corrections_.tell,
        "first tell angles (degrees), the tool's number and its length (mm): B=30,tool=4,length=120");
    addUntil(corrections, corrections_.until);
  }

  void addRecording() {
    auto* record = add("record", "write all samples to a file, and prove that none is missing unnoticed",
                       "probebox record -o scan.pbx --for 10", record_);
    record->add_option("-o,--output", record_.output, "the recording to write; - is the standard output")->required();
    record->add_option("--for", record_.seconds, "stop after so many seconds; without it at Ctrl-C")
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
    auto* exporting = add(
        "export", "turn a recording into a table: CSV, or for NumPy where the name ends with .npy; units in the names",
        "probebox export scan.pbx -o scan.csv", export_);
    exporting->add_option("recording", export_.input,
                          "the recording; - is the standard input, and none that of -u file:");
    exporting->add_option("-o,--output", export_.output, "the table to write; - is the standard output")->required();
    exporting->add_flag("--force", export_.force, "overwrite an existing file");
    exporting
        ->add_option("--triggers", export_.triggers,
                     "a second table, of the triggers: CSV, or for NumPy where the name ends with .npy")
        ->type_name("FILE");
  }

  // Off-line doors to what the box does: files in, files out.
  void addTables() {
    auto* verify = add("verify", "check a recording: every frame, every sequence, every heartbeat's ledger",
                       "probebox -u file:scan.pbx verify", verify_);
    verify->add_option("recording", verify_.input, "the recording; - is the standard input, and none that of -u file:");
    auto* replay = add("replay", "serve a recording as the box that it is from, over TCP",
                       "probebox replay scan.pbx --speed max", replay_);
    replay->add_option("recording", replay_.input, "the recording")->required();
    replay->add_option("--listen", replay_.listen, "where to listen; port 0 takes a free one")
        ->type_name("HOST:PORT")
        ->capture_default_str();
    replay->add_option("--speed", replay_speed_, "times the recorded pace, or max: as fast as hosts read")
        ->check(speed())
        ->type_name("NUMBER|max")
        ->capture_default_str();
    replay->add_flag("--once", replay_.once, "end when the recording has, and the hosts have all of it");
    replay->callback([this] {
      replay_.speed = replay_speed_ == "max" ? 0 : std::strtod(replay_speed_.c_str(), nullptr);
      request_.job = replay_;
    });
    auto* pack = add("pack", "turn a table of whole numbers (first column sample, rising) into a recording",
                     "probebox pack --profile fast scan.csv scan.pbx", pack_);
    addFiles(pack, pack_.input, "the table, CSV", pack_.output, "the recording to write", pack_.force);
    addProfile(pack, pack_profile_);
    pack->add_option("--frame", pack_.frame, "samples in a frame, at most")
        ->check(CLI::Range(std::size_t{1}, kMostFrame))
        ->type_name("NUMBER")
        ->capture_default_str();
    pack->callback([this] {
      pack_.profile = profileOf(pack_profile_);
      request_.job = pack_;
    });
    auto* unpack = add("unpack", "turn a recording into a table of whole numbers as they were recorded",
                       "probebox unpack scan.pbx scan.csv", unpack_);
    addFiles(unpack, unpack_.input, "the recording", unpack_.output, "the table to write, CSV", unpack_.force);
    auto* clock = add("clock", "say which tick of the master clock each edge of a table is",
                      "probebox clock --period-ns 1000000 edges.csv verdicts.csv --ticks ticks.csv", clock_);
    addFiles(clock, clock_.input, "the table: column edge_ns and, where known, line_seqno", clock_.output,
             "one row an edge: edge, tick, flag", clock_.force);
    clock->add_option("--period-ns", clock_.period_ns, "nominal period of the master clock, ns")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
    clock->add_option("--ticks", clock_.ticks, "also write when each tick was, as known at once");
  }

  static void addFiles(CLI::App* command, std::string& input, const std::string& in, std::string& output,
                       const std::string& out, bool& force) {
    command->add_option("input", input, in + "; - is the standard input")->required();
    command->add_option("output", output, out + "; - is the standard output")->required();
    command->add_flag("--force", force, "overwrite an existing file");
  }

  void addCalibrating() {
    add("selftest", "first run on a machine: leads through axis senses and probe signs, and says what is wrong",
        "probebox selftest", selftest_);
    auto* solve = add("solve", "solve measured cases; prints one JSON object a line, in the order given",
                      "probebox solve --json cases/delay-multi-speed/0000", solve_);
    solve->add_option("case", solve_.cases, "case folders: config.json and the tables of measurements")->required();
    auto* report = add("report", "write a page about measured cases: values, U, budget, pictures; it prints on A4",
                       "probebox report cases/delay-multi-speed/0000 -o delay.html", report_);
    report->add_option("input", report_.inputs, "case folders, or files that `probebox solve --json` wrote")
        ->required();
    report->add_option("-o,--output", report_.output, "the HTML to write; - is the standard output")->required();
    report->add_flag("--force", report_.force, "overwrite an existing file");
    auto* calibrate = add("calibrate", "run a calibration on the machine, step by step",
                          "probebox calibrate delay-multi-speed --save delay-today --accept --by Ada", calibrate_);
    calibrate->add_option(
        "method", calibrate_.method,
        "the method; without it delay-multi-speed. Also delay-known-sphere, delay-plates, "
        "delay-per-axis, delay-non-normal, delay-in-out, centreline, centreline-limited-access, centreline-by-steps, "
        "c-axis-alignment, spindle-offset-2x2, spindle-offset-four, periodic-check, "
        "rotary-axis-errors, table-pivot, swivel-error, head-pivot, a-axis-alignment, "
        "screw-calibration, tool-setter, tool-assembly, sensor-head-calibration");
    addRunChoices(calibrate, calibrate_);
    calibrate->add_option("--axis", calibrate_.axis, "whose screw, X, Y or Z; for screw-calibration")
        ->check(CLI::IsMember({"X", "Y", "Z"}, CLI::ignore_case))
        ->type_name("AXIS");
    calibrate->add_option("--turns", calibrate_.turns, "whole turns of the screw, 3 or more; for screw-calibration")
        ->check(CLI::PositiveNumber)
        ->type_name("NUMBER");
    calibrate
        ->add_option("--tool", calibrate_.tool,
                     "number of the tool that is measured; for tool-setter and tool-assembly")
        ->check(CLI::PositiveNumber)
        ->type_name("NUMBER");
    calibrate->add_flag(
        "--head", calibrate_.head,
        "read with the sensor head in the place of the probe, one stand a ball; for rotary-axis-errors");
    calibrate->add_flag("--shank", calibrate_.shank,
                        "read with tip and shank of one stylus, not with tools of several lengths; for "
                        "a-axis-alignment and swivel-error");
    calibrate->add_option("--save", calibrate_.save, "also write what was measured as a case folder");
    calibrate->add_flag("--accept", calibrate_.accept, "accept the result at once (needs --by)");
    calibrate->add_option("--by", calibrate_.by, "the name of the person who accepts");
    calibrate->add_flag("--abort", calibrate_.abort, "end the run that is going on, and begin none");
    calibrate->callback([this] {
      checkCalibrate(calibrate_);
      if (!calibrate_.abort && calibrate_.method.empty()) calibrate_.method = kUsualMethod;
      request_.job = calibrate_;
    });
    add("propose", "have the box solve a measured case, and keep the result until somebody accepts it",
        "probebox propose cases/rotary-axis-errors/C", propose_)
        ->add_option("case", propose_.input, "a case folder: config.json and the tables of measurements")
        ->required();
    auto* accept = add("accept", "put a proposed result into force", "probebox accept 17 --by Ada", accept_);
    accept->add_option("id", accept_.id, "the number of the result, as calibrate printed it and status lists it")
        ->check(wholeNumber())
        ->type_name("NUMBER")
        ->required();
    accept->add_option("--by", accept_.by, "the name of the person who accepts")->required();
    addPlan();
    addGoingBack();
  }

  static void addRunChoices(CLI::App* command, RunChoices& choices) {
    command->add_option("--speed", choices.speeds_mm_s, "speeds of the touches, such as 10,20,40")
        ->delimiter(',')
        ->check(CLI::PositiveNumber)
        ->type_name("MM_PER_S");
    command->add_option("--overtravel", choices.overtravel_mm, "how far into the surface")
        ->check(CLI::PositiveNumber)
        ->type_name("MM");
    command->add_option("--clearance", choices.clearance_mm, "how far off the surface before and after a touch")
        ->check(CLI::PositiveNumber)
        ->type_name("MM");
    command->add_option("--approach", choices.approach_deg, "how far off the normal; for delay-non-normal")
        ->check(CLI::PositiveNumber)
        ->type_name("DEGREES");
    command
        ->add_option("--angles", choices.angles,
                     "how many angles of C; for centreline, centreline-limited-access and rotary-axis-errors")
        ->check(CLI::PositiveNumber)
        ->type_name("NUMBER");
    command
        ->add_option("--arc", choices.arc_deg,
                     "over which C can be turned, 360 without it; for centreline and rotary-axis-errors, and for "
                     "centreline-limited-access and centreline-by-steps, 80 without it")
        ->check(CLI::PositiveNumber)
        ->type_name("DEGREES");
    command
        ->add_option("--heights", choices.balls,
                     "how many balls at different heights; for c-axis-alignment and rotary-axis-errors")
        ->check(CLI::PositiveNumber)
        ->type_name("NUMBER");
  }

  void addPlan() {
    auto* plan = add("plan", "the uncertainty that a calibration will have, and which touches are the best for a time",
                     "probebox plan delay-multi-speed --time 60", plan_);
    plan->add_option("method", plan_.method, "a method that calibrate runs")->required();
    addRunChoices(plan, plan_);
    plan->add_option("--time", plan_.time_s, "propose the most precise sets that fit into it")
        ->check(seconds())
        ->type_name("SECONDS");
    const auto add_positive = [&](const char* name, std::optional<double>& value, const char* what, const char* unit) {
      plan->add_option(name, value, what)->check(CLI::PositiveNumber)->type_name(unit);
    };
    add_positive("--machine-rate", plan_.machine_rate_hz, "of the positions; 1000 without it", "HZ");
    add_positive("--machine-noise", plan_.machine_noise_um, "of one position, k = 1; 0.5 without it", "UM");
    add_positive("--probe-rate", plan_.probe_rate_hz, "of the deflections; 2000 without it", "HZ");
    add_positive("--probe-noise", plan_.probe_noise_um, "of one channel, k = 1; 0.4 without it", "UM");
    add_positive("--acceleration", plan_.acceleration_mm_s2, "of the machine; 10000 without it", "MM_PER_S2");
  }

  void addGoingBack() {
    auto* rollback = add("rollback", "go back to the result that was in force before",
                         "probebox rollback delay --by Ada", rollback_);
    rollback
        ->add_option("what", rollback_.what,
                     "what the results are about (delay, centreline, screw-x, ...), a method that answers it, or the "
                     "number of the result to go back from")
        ->required();
    rollback->add_option("--by", rollback_.by, "the name of the person who goes back")->required();
    auto* history =
        add("history", "every change of stored results, with who and when", "probebox history delay", history_);
    history->add_option("what", history_.what, "only of one result (its number), or about one subject or method");
  }

  static void checkCalibrate(const Calibrate& options) {
    if (options.abort && !options.method.empty()) {
      throw CLI::ValidationError{"calibrate", "--abort ends the run that is going on; name no method with it"};
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
