#include "tools/gcode/loop/fanuc.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "tools/gcode/dialect.hpp"
#include "tools/gcode/loop/locals.hpp"

namespace probebox::gcode::loop {
namespace {

constexpr int kHelpersFrom = 40;    // number of the first helper, from the first program on
constexpr std::size_t kShown = 26;  // characters of a message
constexpr std::string_view kMill = "{mill}", kLathe = "{lathe}", kEach = "{each}";
constexpr int kFirstLocal = 120, kLastLocal = 199, kFirstShared = 550, kLastShared = 699;
// Programs of their own: one word from the PMC and to it, 32 bits of either, a guarded move, the state of the control.
// "@40" is the number of a program, {name} a variable. A line that begins with {mill} or {lathe} is for these alone,
// one that begins with {each} is written for each linear axis.
constexpr std::string_view kHelpers = R"(O@40 (ONE WORD FROM OR TO THE PMC: #101 WORD, #102 VALUE, #103 1 TO WRITE)
#104=FIX[#1133/1073741824]
#104=[1-#104]
#105=[#104*16384+#103*8192+#101]
#1133=[#105*65536+#102*#103]
#106=0
N1 G53
IF [FIX[#1033/65536] EQ #105] GOTO 2
#106=[#106+1]
G4 P4
IF [#106 LT 500] GOTO 1
M98 P@47
#3000=90 (PMC DOES NOT ANSWER)
N2 IF [#103 EQ 1] GOTO 3
#102=[#1033-FIX[#1033/65536]*65536]
N3 M99
O@41 (32 BITS WITHOUT SIGN, HIGH WORD FIRST: #101 FIRST WORD, #102 VALUE)
#103=0
M98 P@40
#107=#102
#101=[#101+1]
M98 P@40
#102=[#107*65536+#102]
M99
O@42 (IEEE 754, 32 BITS: #101 FIRST WORD, #102 VALUE)
M98 P@41
#108=1
IF [#102 LT 2147483648] GOTO 1
#108=-1
#102=[#102-2147483648]
N1 #109=FIX[#102/8388608]
IF [#109 EQ 0] GOTO 4
#102=[#102-#109*8388608+8388608]
#109=[#109-150]
N2 IF [#109 GE 0] GOTO 3
#102=[#102/2]
#109=[#109+1]
GOTO 2
N3 IF [#109 LE 0] GOTO 5
#102=[#102*2]
#109=[#109-1]
GOTO 3
N4 #102=0
N5 #102=[#102*#108]
M99
O@43 (32 BITS WITH SIGN TO THE PMC: #101 FIRST WORD, #102 VALUE)
#107=ROUND[#102]
IF [#107 GE 0] GOTO 1
#107=[#107+4294967296]
N1 #102=FIX[#107/65536]
#103=1
M98 P@40
#102=[#107-#102*65536]
#101=[#101+1]
M98 P@40
M99
O@44 (A MOVE THAT THE PROBE STOPS: TO #110 #111 #112 AT #113)
G31 {to} F#113
G53
{each}IF [ABS[#{work}-#{target}] GT 0.05] GOTO 1
M99
N1 M98 P@47
#3000=91 (PROBE TOUCHED ON THE WAY)
M99
O@45 (MODES, COOLANT OFF, NO LENGTH, AND {frame} AS THE MACHINE'S OWN COORDINATES: NOTHING MOVES)
{plane} G21 G40 G80
{mill}G90 G94 G61
{lathe}G98 G61
M9
G53
{mill}G0 G49 G53 Z#5023
{write} {zero}
{frame}
G53
{each}IF [ABS[#{work}-#{machine}] GT 1] GOTO 1
{each}#{target}=#{work}
M99
N1 M98 P@47
{mill}#3000=94 (CANCEL G52 G92 EXT OFFSET)
{lathe}#3000=94 (CANCEL G52 G50 EXT OFFSET)
M99
O@46 (KEEPS THE STATE OF THE CALLER. REFUSES WHAT WOULD BEND THE WAY)
IF [FIX[#4011] EQ 51] THEN #3000=93 (CANCEL SCALING G50)
{mill}IF [FIX[#4016] EQ 68] THEN #3000=93 (CANCEL ROTATION G69)
{lathe}IF [FIX[#4017] EQ 68] THEN #3000=93 (CANCEL ROTATION G69.1)
{lathe}IF [#4004 EQ 68] THEN #3000=93 (CANCEL TURRET MIRROR G69)
{lathe}IF [ABS[#4021-12.1] LT 0.05] THEN #3000=93 (CANCEL POLAR MODE G13.1)
{lathe}IF [[#4120-100*FIX[#4120/100]] NE 0] THEN #3000=93 (CALL T WITH OFFSET 00)
IF [FIX[#4022] EQ 51] THEN #3000=93 (CANCEL MIRROR G50.1)
IF [#4006 NE 21] THEN #3000=93 (CALL IT IN MM: G21)
IF [#4007 NE 40] THEN #3000=93 (CANCEL COMPENSATION G40)
{mill}IF [ABS[#4008-43.5] LT 0.3] THEN #3000=93 (CANCEL TIP CONTROL G49)
(AN EARLIER RUN WAS RESET: ITS VALUES OF {frame} STAY KEPT)
IF [{_pb_kept} NE 20546] GOTO 1
IF [[{sum}] EQ 0] GOTO 2
{keep}
{mill}N2 {_pb_kept_plane}=#4002
{mill}{_pb_kept_absolute}=#4003
{lathe}N2 {_pb_kept_plane}=#4016
{_pb_kept_feed}=#4005
{_pb_kept_frame}=#4014
{_pb_kept_stop}=#4015
IF [ABS[#4014-54.5] GT 0.45] GOTO 3
{_pb_kept_further}=#4130
N3 {_pb_kept}=20546
M99
O@47 (GIVES IT BACK. AFTER A RESET ON THE WAY: CALL IT BY MDI)
IF [{_pb_kept} NE 20546] GOTO 3
{mill}G90 {write} {back}
{lathe}{back to variables}
IF [ABS[{_pb_kept_frame}-54.5] GT 0.45] GOTO 1
G54.1 P{_pb_kept_further}
GOTO 2
N1 G{_pb_kept_frame}
{mill}N2 G{_pb_kept_plane} G{_pb_kept_absolute} G{_pb_kept_feed} G{_pb_kept_stop}
{lathe}N2 G{_pb_kept_plane} G{_pb_kept_feed} G{_pb_kept_stop}
{_pb_kept}=0
N3 M99
)";

class FanucWriter final : public Writer {
 public:
  FanucWriter(Axes axes, int first, int frame) : Writer{std::move(axes)}, first_{first}, frame_{frame} {}

 protected:
  void begin(const std::vector<Subprogram>& subprograms) override {
    for (const auto& one : subprograms) programs_[one.name] = first_ + static_cast<int>(programs_.size());
    if (programs_.size() > kHelpersFrom) fail("more subprograms than there are numbers");
    for (const auto& [name, place] : placesOfLocals(subprograms)) {
      const int number = kFirstLocal + static_cast<int>(place), beyond = number - kLastLocal - 1;
      numbers_[name] = beyond < 0 ? number : kFirstShared + beyond;
      next_shared_ = std::max(next_shared_, kFirstShared + beyond + 1);
    }
    line("%");
  }
  void end() override {
    for (std::string_view rest = kHelpers; !rest.empty();) {
      const auto cut = rest.find('\n');
      helper(rest.substr(0, cut));
      rest.remove_prefix(cut + 1);
    }
    line("O" + std::to_string(first_ + kHelpersFrom + 9) +
         " (VARIABLES THAT THE PROGRAMS TAKE: #100 TO #115, #700 TO #999, AND)");
    for (const auto& [name, number] : numbers_) line(comment("#" + std::to_string(number) + " " + name));
    line("M99");
    line("%");
  }
  void beginSubprogram(const Subprogram& one) override {
    subprogram_ = one.name;
    line("O" + std::to_string(programs_[one.name]) + " " + comment("PROBEBOX " + one.name));
    if (one.name == "places") toolSetting();
    if (one.name != "main") return;
    explain(
        axes().lathe ? "lathes: Fanuc 0i-TD and later, 30i to 32i, with custom macro B and G-code system A"
                     : "Fanuc 0i-D and later, 30i to 32i, with custom macro B",
        {"Call: G65 P" + std::to_string(first_) +
             " A4. B1. C0. I0. J0. K0. - method, axis, tool, read by, mounts, contacts; what is left out is 0. In G21.",
         "Overwrites without asking: common variables #100 to #199 and #" + std::to_string(kFirstShared) +
             " to #999, where other macros may keep data; programs O" + std::to_string(first_) + " to O" +
             std::to_string(first_ + kHelpersFrom + 9) +
             ", another number by --number. Save what is yours before the first start.",
         "While it runs, " + frame() +
             " is the machine's own frame: choose one that nobody uses (--frame). At its end, and where it ends itself "
             "with an alarm, it gives back work offset, the values of " +
             frame() + ", G17 to G19, " + (axes().lathe ? "G98 or G99" : "G90, G94") +
             " and G61 to G64. After a reset or power-off on the way " + frame() + " stays at zero until O" +
             std::to_string(first_ + kHelpersFrom + 7) +
             " is called by MDI, which does the same from variables that outlast power-off.",
         std::string{"It leaves behind: "} +
             (axes().lathe ? "no tool offset (call T with one again), coolant off (M9), the turret at the tool of the "
                             "last step, Z at the safe height."
                           : "no length offset (call G43 H again before Z moves), coolant off (M9), the tool of the "
                             "last step in the spindle, Z at the safe height."),
         axes().lathe ? toolsOfLathe() : toolsOfMill(),
         "A Fanuc is no Modbus master: its Modbus/TCP option (0i-D: R968) is a server, as the box is. A gateway that "
         "is master "
         "of the box and speaks a bus of the control (Profibus, Profinet, EtherNet/IP, or client of that option) keeps "
         "the "
         "areas below in the PMC: word N in D(base + 2 N).",
         "Parameter 6001 bit 0 (MIF) = 1: UI100 to UI131 (#1033) and UO100 to UO131 (#1133) exist. Look their G and F "
         "addresses up in your connection manual. Ladder: when bits 16 to 31 of UO100 on differ from those of UI100 "
         "on: "
         "address = bits 16 to 28, bit 29 write, bit 30 turns over. Write: word(address) := bits 0 to 15 of UO. Read: "
         "bits 0 "
         "to 15 of UI := word(address). Then bits 16 to 31 of UI := those of UO.",
         "The option of common variables #100 to #199 and #500 to #999; 8-byte precision (0i-D: parameter 6008 bit 0 = "
         "0); "
         "subprograms 10 "
         "deep; G53 ends the look-ahead; G31 with acceleration (parameter 6200 bit 7, SKF = 1), its skip signal the "
         "probe."});
    for (int i = 1; i <= 6; ++i) line(variable("main/" + std::to_string(i)) + "=[#" + std::to_string(i) + "+0]");
    callHelper(46);
  }
  void endSubprogram() override {
    if (subprogram_ == "main") callHelper(47);
    line("M99");
  }
  std::string comment(std::string_view text) const override { return "(" + plain(text) + ")"; }

  std::string variable(const std::string& name) override {
    if (const auto found = numbers_.find(name); found != numbers_.end()) return "#" + std::to_string(found->second);
    if (next_shared_ > kLastShared) fail("more variables than the control has: " + name);
    numbers_[name] = next_shared_;
    return "#" + std::to_string(next_shared_++);
  }
  std::string programNamed(const std::string& subprogram) override {
    return "O" + std::to_string(programs_.at(subprogram)) + " " + subprogram;
  }
  std::string placeSaid(int first, const std::string& rest) const override {
    return "#" + std::to_string(first) + " + " + rest;
  }
  int placeOfTable(int number) const override { return number < 1200 ? number - 300 : number - 400; }
  std::string table(const std::string& index) override { return index.starts_with('[') ? "#" + index : "#" + index; }
  std::string call(const std::string& function, const std::string& argument) const override {
    return function + (argument.starts_with('[') ? argument : "[" + argument + "]");
  }
  std::string operation(const std::string& left, std::string_view sign, const std::string& right) const override {
    return "[" + left + std::string{sign} + right + "]";
  }
  std::string remainder(const std::string& left, const std::string& right) const override {
    return "[" + left + "-" + right + "*FIX[" + left + "/" + right + "]]";
  }

  // The value is in #102 until the next one is read: each goes to a variable of its own.
  std::string read(const Place& place) override {
    const auto kind = place.entry->kind;
    line("#101=" + std::to_string(place.word));
    if (kind == modbus::Kind::u16) line("#103=0");
    callHelper(kind == modbus::Kind::u16 ? 40 : kind == modbus::Kind::f32 ? 42 : 41);
    const auto into = variable("read/" + std::to_string(reads_++ % 4));
    line(into + "=#102");
    return into;
  }
  void write(const Place& place, const std::string& value) override {
    const auto scale = number(1 / place.entry->scale);
    line("#102=" + (place.entry->scale == 1 ? value : operation(value, "*", scale)));
    line("#101=" + std::to_string(place.word));
    if (registersOf(place.entry->kind) == 2) return callHelper(43);
    line("#102=ROUND[#102]");
    line("#103=1");
    callHelper(40);
  }
  std::string position(char axis) override { return inRadius(axis, 5021); }
  std::string commanded(char axis) override { return inRadius(axis, 5041); }
  std::string tool() override { return variable("_pb_spindle"); }
  std::string toolForSure() override { return variable("_pb_changed"); }

  void assign(const std::string& target, const std::string& value) override { line(target + "=" + value); }
  void label(int number) override { line("N" + std::to_string(number)); }
  void jump(int number) override { line("GOTO " + std::to_string(number)); }
  void jumpIf(const std::string& left, std::string_view relation, const std::string& right, int number) override {
    line("IF [" + left + " " + std::string{relation} + " " + right + "] GOTO " + std::to_string(number));
  }
  void callSubprogram(const std::string& name) override { line("M98 P" + std::to_string(programs_[name])); }
  void giveBack() override { line("M99"); }
  // Alarms show 26 characters.
  void abort(std::string_view text) override {
    comments(text);
    callHelper(47);
    line("#3000=92 (PROBEBOX: SEE PROGRAM)");
  }
  void message(std::string_view text) override {
    comments(text);
    said_ = plain(text);
  }

  void settings() override { callHelper(45); }
  void wait(const std::string& seconds) override { line("G4 P[ROUND[1000*" + seconds + "]]"); }
  void settle() override { line("G53"); }
  void orient() override { line("M19"); }
  // With the message before it, where that is shown as a whole.
  void stop() override {
    line(said_.empty() || said_.size() > kShown ? "M0" : "#3006=1 (" + said_ + ")");
    said_.clear();
  }
  void takeTool(const std::string& number) override {
    line(axes().lathe ? "T" + operation("100", "*", number) : "T" + number + " M6");
    line(tool() + "=" + number);
    line(toolForSure() + "=" + number);
  }
  void turn(const std::map<char, std::string>& to, const std::string& feed, Turn how) override {
    std::string words = how == Turn::until_touched ? "G31" : feed.empty() ? "G0" : "G1";
    for (const auto& [letter, value] : to) words += std::string{" "} + letter + value;
    line(words + (feed.empty() ? "" : " F" + feed));
    if (how == Turn::until_touched) line("G53");
  }
  void arc(const std::map<char, std::string>& to, const std::array<std::string, 2>& centre, const std::string& feed,
           bool clockwise) override {
    aim(to, feed);
    line("#114=" + centre[0]);
    line("#115=" + centre[1]);
    line(std::string{clockwise ? "G2" : "G3"} + " X#110 Y#111 I#114 J#115 F#113");
  }
  void move(const std::map<char, std::string>& to, const std::string& feed, bool guarded) override {
    aim(to, feed);
    if (guarded) return callHelper(44);
    line("G1 " + target() + " F#113");
  }
  void seek(const std::map<char, std::string>& to, const std::string& feed) override {
    aim(to, feed);
    line("G31 " + target() + " F#113");
    line("G53");
  }

 private:
  static int targetOf(char axis) { return 110 + axis - 'X'; }
  unsigned numberOf(char axis, unsigned first) const {
    return first + static_cast<unsigned>(axes().letters.find(axis));
  }
  // X of a lathe is in diameters, in words and variables alike.
  bool onDiameter(char axis) const { return axes().lathe && axis == 'X'; }
  std::string inRadius(char axis, unsigned first) const {
    const std::string all = "#" + std::to_string(numberOf(axis, first));
    return onDiameter(axis) ? operation(all, "/", "2") : all;
  }
  void aim(const std::map<char, std::string>& to, const std::string& feed) {
    for (const auto& [letter, value] : to)
      line("#" + std::to_string(targetOf(letter)) + "=" + (onDiameter(letter) ? operation("2", "*", value) : value));
    if (!feed.empty()) line("#113=" + feed);
  }
  // Words of the linear axes: "X#110 Z#112".
  std::string target() const {
    std::string words;
    for (const char axis : linearAxes())
      words += (words.empty() ? "" : " ") + std::string{axis} + "#" + std::to_string(targetOf(axis));
    return words;
  }
  std::string toolsOfMill() {
    return "Which tool is in the spindle: the first line of " + programNamed("places") +
           ". #4120 is the T that was called last, which on a changer that stages the next tool is the one that "
           "waits. The first change is made in any case.";
  }
  std::string toolsOfLathe() {
    return "X is programmed in diameters: bit 3 (DIA) of parameter 1006 is 1 for it, and no G10.9 changes that. Where "
           "it is not, X moves twice as far: run selftest first (A9.), whose jogs show it. Places below are in radius. "
           "G90, G92 and G94 are cycles of this system and do not occur. T has two digits for the "
           "station and two for the offset (bit 0, LD1, of parameter 5002 is 0): it takes T0100 for tool 1, without an "
           "offset. Call T with offset 00 before the program, where that may move the axes: it begins with an alarm "
           "where one is active. The turret turns with Z at the safe height, wherever X is: nothing that it carries "
           "may "
           "reach anything there. It is as #4120 says, the T that was called last; where it is turned by hand, see the "
           "first line of " +
           programNamed("places") +
           ". The first change is made in any case. C: the main spindle stands, its contouring is on and its brake "
           "released, by the M codes of your builder, before the call.";
  }
  std::string helperNumber(int number) const { return std::to_string(first_ + number); }
  void callHelper(int number) { line("M98 P" + helperNumber(number)); }
  // Joins for all axes the letter and the text given for it.
  std::string eachAxis(const auto& said) const {
    std::string words;
    for (std::size_t i = 0; i < axes().letters.size(); ++i)
      words += (i == 0 ? "" : " ") + std::string{axes().letters[i]} + said(i);
    return words;
  }
  // The work offset that the programs make the machine's own coordinates: G54.1 P1 to P48, or 0: G59, which every
  // control has.
  std::string frame() const { return frame_ == 0 ? "G59" : "G54.1 P" + std::to_string(frame_); }
  unsigned valuesOfFrame() const { return frame_ == 0 ? 5321U : 7001U + 20U * static_cast<unsigned>(frame_ - 1); }
  std::string kept(std::size_t axis) { return variable("_pb_kept_" + std::to_string(axis + 1)); }
  // Writes a line of the helpers: numbers of programs and variables in place of "@40" and {name}.
  void helper(std::string_view text) {
    if (text == "{keep}") {
      for (std::size_t i = 0; i < axes().letters.size(); ++i)
        line((i == 0 ? "N1 " : "") + kept(i) + "=#" + std::to_string(valuesOfFrame() + i));
      return;
    }
    if (text == "{back to variables}") {
      for (std::size_t i = 0; i < axes().letters.size(); ++i)
        line("#" + std::to_string(valuesOfFrame() + i) + "=" + kept(i));
      return;
    }
    for (const auto& [mark, is] : {std::pair{kMill, !axes().lathe}, {kLathe, axes().lathe}}) {
      if (!text.starts_with(mark)) continue;
      if (is) helper(text.substr(mark.size()));
      return;
    }
    if (text.starts_with(kEach)) {
      for (const char axis : linearAxes()) line(filled(text.substr(kEach.size()), axis));
      return;
    }
    line(filled(text, 'X'));
  }
  // axis: the one that {work}, {machine} and {target} number.
  std::string filled(std::string_view text, char axis) {
    std::string all;
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (text[at] == '@') {
        all += helperNumber((text[at + 1] - '0') * 10 + text[at + 2] - '0');
        at += 2;
      } else if (text[at] == '{') {
        const auto end = text.find('}', at);
        const std::string name{text.substr(at + 1, end - at - 1)};
        if (name == "work" || name == "machine") {
          all += std::to_string(numberOf(axis, name == "work" ? 5041 : 5021));
        } else if (name == "target") {
          all += std::to_string(targetOf(axis));
        } else if (name == "to") {
          all += target();
        } else if (name == "plane") {
          all += has('Y') ? "G17" : "G18";
        } else if (name == "sum") {
          for (const char each : linearAxes())
            all += (each == 'X' ? "ABS[#" : "+ABS[#") + std::to_string(numberOf(each, valuesOfFrame())) + "]";
        } else if (name == "frame") {
          all += frame();
        } else if (name == "write") {
          all += frame_ == 0 ? "G10 L2 P6" : "G10 L20 P" + std::to_string(frame_);
        } else if (name == "zero") {
          all += eachAxis([](std::size_t) { return std::string{"0"}; });
        } else if (name == "back") {
          all += eachAxis([&](std::size_t i) { return kept(i); });
        } else {
          all += variable(name);
        }
        at = end;
      } else {
        all += text[at];
      }
    }
    return all;
  }
  void toolSetting() {
    comments(
        axes().lathe
            ? "Number of the variable that holds the station of the turret. #4120 is the T that was called last: right "
              "where nobody turns the turret by hand. Else put here the variable in which your builder's PMC keeps the "
              "station. Where it is wrong, the first rise is reckoned with the length of another tool and may end too "
              "low."
            : "Number of the variable that holds the tool in the spindle. #4120 is the T that was called last: right "
              "where a T is called with its M6 only. Where the changer stages the next tool, or is a random one, put "
              "here the variable in which your builder's M6 or PMC keeps the tool in the spindle. Where it is wrong, "
              "the first rise is reckoned with the length of another tool and may end too low.");
    line(variable("_pb_spindle_at") + "=4120");
    line(tool() + "=#[" + variable("_pb_spindle_at") + "]");
    if (axes().lathe) stationOfT();
    line(toolForSure() + "=-1");
  }
  // A T of a lathe has the offset behind the station; a variable of the builder has the station alone.
  void stationOfT() {
    const int known = newLabel();
    jumpIf(variable("_pb_spindle_at"), "NE", "4120", known);
    line(tool() + "=FIX[" + tool() + "/100]");
    label(known);
  }

  int first_{};
  int frame_{};
  std::string subprogram_;
  std::string said_;  // by the last message
  std::map<std::string, int> programs_;
  std::map<std::string, int> numbers_;
  int next_shared_{kFirstShared};
  unsigned reads_{};
};

}  // namespace

std::unique_ptr<Writer> fanucWriter(Axes axes, int first, int frame) {
  return std::make_unique<FanucWriter>(std::move(axes), first, frame);
}

}  // namespace probebox::gcode::loop
