#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/messages/types.hpp"

// Holds the parsed command line.
namespace probebox::command {

// When a display ends by itself: after a time or a number of updates; both empty: at Ctrl-C.
struct Until {
  std::optional<double> seconds;
  std::optional<std::uint64_t> count;
};

struct List {
  double timeout_s{1.0};  // for each box
  bool watch{};           // keep reporting boxes that appear or disappear
  Until until;
};
struct Info {};
struct Status {};
// Writes what `status` and `corrections` say as Prometheus' text.
struct Metrics {
  std::string output{"-"};  // "-" is the standard output
};
// How long a command waits for a box that has gone, in seconds.
inline constexpr double kUsualPatience_s = 30;

struct Watch {
  Until until;
  std::optional<messages::Profile> profile;  // nothing: the one that suits the link
  double patience_s{kUsualPatience_s};
};
struct Record {
  std::string output;  // "-" is the standard output
  std::optional<double> seconds;
  double patience_s{kUsualPatience_s};
  std::optional<messages::Profile> profile;  // nothing: the one that suits the link
  bool live{};  // the box drops the oldest samples, not the newest, when the link is too slow
  bool force{};
  bool on_trigger{};    // record only the first trigger and the samples around it
  std::string for_box;  // an option that was given and means nothing for a recording
  double before_s{2};
  double after_s{1};
};
struct Export {
  std::string input;  // "-" is the standard input
  std::string output;
  bool force{};
  std::string triggers;  // file of a separate table of triggers; empty for none
  bool points{};         // columns about the tip and the surface
  std::optional<double> friction;
};
struct Verify {
  std::string input;  // "-" is the standard input
};
struct Replay {
  std::string input;
  std::string listen{"127.0.0.1:7627"};
  double speed{1};  // 0: as fast as hosts read
  bool once{};      // end when the hosts have received the whole recording and stopped
};
struct Pack {
  std::string input;  // "-" is the standard input
  std::string output;
  messages::Profile profile{messages::Profile::fast};
  std::size_t frame{256};  // samples
  bool force{};
};
struct Unpack {
  std::string input;  // "-" is the standard input
  std::string output;
  bool force{};
};
struct Clock {
  std::string input;  // "-" is the standard input
  std::string output;
  std::string ticks;  // empty: not written
  std::int64_t period_ns{};
  bool force{};
};
// Serves a page about a box to a browser on this computer.
struct View {
  std::uint16_t port{};  // 0: a free one
  std::string cell;      // description of machine, fixture, workpiece and tools; empty for none
};
// Moves a tool along a program through a cell and reports solids that come too near.
struct Interference {
  std::string cell;  // its description
  std::uint32_t tool{};
  std::string program;  // G-code
  double step_mm{0.1};
  bool stored{};  // use the stored lengths even where measured ones exist
};
struct Solve {
  std::vector<std::string> cases;  // with `methods`: names of methods; empty for all
  bool methods{};
  bool text{};  // print a table even where the output is no terminal
};
struct Report {
  std::vector<std::string> inputs;  // results by number or subject, case folders, files of answers
  std::string output;               // "-" is the standard output
  bool force{};
};
// Options of a run; the method chooses those that are empty.
struct RunChoices {
  std::string method;
  std::vector<double> speeds_mm_s;
  std::optional<double> overtravel_mm;
  std::optional<double> clearance_mm;
  std::optional<double> approach_deg;
  std::optional<double> arc_deg;
  std::optional<std::uint16_t> angles;
  std::optional<std::uint16_t> balls;
  std::string axis;  // X, Y, Z, B or C
  std::optional<std::uint16_t> turns;
  std::optional<std::uint32_t> tool;
  bool head{};
  bool shank{};
  std::optional<std::uint8_t> spindle;
  bool contacts{};  // C turns until the ball touches, first
};
struct Calibrate : RunChoices {
  std::optional<std::uint16_t> stations;
  std::optional<std::uint8_t> mounts;
  std::optional<double> temperature_c;  // of sphere and part in this run; nothing: as machine.toml says
  std::string save;                     // folder; empty: not saved
  bool abort{};                         // start nothing; abort the current run
  bool accept{};
  bool although_it_differs{};  // from the result in force
  std::string by;
};
struct Plan : RunChoices {
  std::string machine;  // file; empty: the machine of the box that is named, or a usual one
  std::string probe,
      unit;  // files; empty: the probe of the box or a usual one, and the sphere's certificate in the box
  std::optional<double> time_s;  // propose runs that fit into this time
  std::optional<double> machine_rate_hz;
  std::optional<double> machine_noise_um;
  std::optional<double> probe_rate_hz;
  std::optional<double> probe_noise_um;
  std::optional<double> switch_noise_um;
  std::optional<double> acceleration_mm_s2;
};
struct Gcode : RunChoices {
  bool loop{};       // the program that reads its steps from the box, in place of the steps of one method
  std::string axes;  // of the control, for that program, as it numbers them; empty: XYZABC
  std::string dialect;
  std::string output;   // the program, or its picture where the name ends with .svg; "-" is the standard output
  std::string picture;  // empty: none
  std::string tape;     // device of the line to the box; empty: the dialect's usual one
  bool stops{};         // a person marks the steps, instead of lines that the control prints
  bool force{};
  std::vector<double> at_mm, c_axis_mm, table_axis_mm;  // X, Y, Z, or empty
  std::vector<std::string> balls_mm;                    // "X,Y,Z" each
  std::vector<double> tilts_deg;
  std::vector<std::uint32_t> probe_tools;
  std::optional<std::uint32_t> head_tool;
  std::string b_axis;              // "X", "-Y"; empty: X
  std::vector<std::string> words;  // "A=M19 R" each
  std::optional<unsigned> number;  // of the program
  std::optional<int> frame;        // of the loop program of a Fanuc: G54.1 P; 0: G59
  std::optional<double> machine_z_mm;
  double deflection_limit_mm{1};
  bool no_skip{};    // the control cannot stop by the probe
  bool no_orient{};  // the stylus cannot turn with the spindle
  std::optional<double> safe_z_mm, sphere_mm, gap_mm, bore_mm, setter_mm, stylus_mm, tool_diameter_mm;
  std::vector<double> cube_mm;
  double traverse_mm_min{1500};
  double most_mm_min{6000};
};
struct Selftest {};
struct Propose {
  std::string input;       // a case folder
  bool as_this_machine{};  // a case that names no probe, machine or mounting was measured with those of this box
  std::string by;          // the person who vouches for that
};
struct Accept {
  std::uint64_t id{};
  std::string by;
  bool although_it_differs{};  // from the result in force
};
struct Results {
  std::string subject;  // or a method; empty: all
};
struct Show {
  std::uint64_t id{};
};
struct Home {
  std::vector<std::string> axes;  // "X=0", "Y=120.5"
  std::string by;                 // a person, for the box's log; may be empty
};
struct Rollback {
  std::string what;  // the number of a result, a subject, or a method
  std::string by;
};
struct History {
  std::string what;  // the number of a result, a subject, or a method; empty: everything
};
struct Corrections {
  std::optional<std::string> sum;   // sources to sum from now on
  std::optional<std::string> tell;  // angles of the rotary axes and the current tool, to be sent to the box
  bool follow{};
  Until until;
};

struct Inhibit {
  std::string what;        // on, off, or empty: only show who holds one
  std::string by;          // the person who holds it; empty: this link holds it
  std::string connection;  // with off: the connection whose inhibit ends; empty: one's own
};

// Writes the identity of a box, once; and the keys of its tls: links.
struct Provision {
  std::string input;  // unit.toml; empty: keys alone
  std::string keys;   // folder with box.crt, box.key, people.crt; empty: none
  bool check{};       // only look whether unit.toml is good
};

// Measures a box before it is shipped and writes a sheet.
struct FactoryTest {
  std::string output;                 // "-" is the standard output
  double seconds{10};                 // of samples
  std::vector<std::string> undriven;  // names of lines of the sheet that the fixture cannot drive
  std::string by;
  bool force{};
};

// Writes a calibration certificate of a stored result.
struct Certificate {
  std::uint64_t id{};
  std::string output;    // "-" is the standard output
  std::string by;        // who issues it
  std::string next_due;  // of this calibration; empty: not stated
  // Files of the laboratory's template: for a page (HTML), which may do without, or for a DCC (XML).
  std::string laboratory, dcc;
  bool force{};
};

// Hands a bundle to the box, and follows what comes of it.
struct Update {
  std::string bundle;  // empty: only show how an update stands
  bool force{};        // also a version that is not newer
  bool no_wait{};      // end when the box has the bundle
  // Of the front end on this computer, in place of a bundle.
  std::string front_end;  // its UF2 file
  std::string drive;      // the folder of its boot loader's drive; empty: it is looked for
  std::string receiver;   // its serial number; empty for the only one
  double patience_s{1800};
};

using Job = std::variant<List, Info, Status, Metrics, Watch, Record, Export, Verify, Replay, Pack, Unpack, Clock, Solve,
                         Report, Calibrate, Plan, Gcode, Selftest, Propose, Accept, Rollback, Results, Show, History,
                         Corrections, Home, Inhibit, View, Interference, Provision, FactoryTest, Certificate, Update>;

struct Request {
  Job job;
  std::string uri;  // empty: PROBEBOX_URI, or the only box there is
  bool json{};
};

}  // namespace probebox::command
