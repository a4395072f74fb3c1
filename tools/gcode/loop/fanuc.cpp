#include "tools/gcode/loop/fanuc.hpp"

#include <map>
#include <string>
#include <utility>

#include "tools/gcode/dialect.hpp"

namespace probebox::gcode::loop {
namespace {

constexpr int kFirstProgram = 9010;
constexpr int kFirstLocal = 120, kLastLocal = 199, kFirstShared = 510, kLastShared = 699;
// Programs of their own: one word from the PMC and to it, 32 bits of either, a guarded move.
constexpr std::string_view kHelpers = R"(O9040 (ONE WORD FROM OR TO THE PMC: #101 WORD, #102 VALUE, #103 1 TO WRITE)
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
#3000=90 (PMC DOES NOT ANSWER)
N2 IF [#103 EQ 1] GOTO 3
#102=[#1033-FIX[#1033/65536]*65536]
N3 M99
O9041 (32 BITS WITHOUT SIGN, HIGH WORD FIRST: #101 FIRST WORD, #102 VALUE)
#103=0
M98 P9040
#107=#102
#101=[#101+1]
M98 P9040
#102=[#107*65536+#102]
M99
O9042 (IEEE 754, 32 BITS: #101 FIRST WORD, #102 VALUE)
M98 P9041
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
O9043 (32 BITS WITH SIGN TO THE PMC: #101 FIRST WORD, #102 VALUE)
#107=ROUND[#102]
IF [#107 GE 0] GOTO 1
#107=[#107+4294967296]
N1 #102=FIX[#107/65536]
#103=1
M98 P9040
#102=[#107-#102*65536]
#101=[#101+1]
M98 P9040
M99
O9044 (A MOVE THAT THE PROBE STOPS: TO #110 #111 #112 AT #113)
G31 X#110 Y#111 Z#112 F#113
G53
IF [ABS[#5041-#110] GT 0.05] GOTO 1
IF [ABS[#5042-#111] GT 0.05] GOTO 1
IF [ABS[#5043-#112] GT 0.05] GOTO 1
M99
N1 #3000=91 (PROBE TOUCHED ON THE WAY)
M99
)";

class FanucWriter final : public Writer {
 public:
  using Writer::Writer;

 protected:
  void begin(const std::vector<Subprogram>& subprograms) override {
    for (const auto& one : subprograms) programs_[one.name] = kFirstProgram + static_cast<int>(programs_.size());
    line("%");
  }
  void end() override {
    for (std::string_view rest = kHelpers; !rest.empty();) {
      const auto cut = rest.find('\n');
      line(std::string{rest.substr(0, cut)});
      rest.remove_prefix(cut + 1);
    }
    line("O9049 (VARIABLES THAT THE PROGRAMS TAKE: #100 TO #113, #700 TO #999, AND)");
    for (const auto& [name, number] : numbers_) line(comment("#" + std::to_string(number) + " " + name));
    line("M99");
    line("%");
  }
  void beginSubprogram(const Subprogram& one) override {
    line("O" + std::to_string(programs_[one.name]) + " " + comment("PROBEBOX " + one.name));
    if (one.name != "main") return;
    explain(
        "Fanuc 0i-D and later, 30i to 32i, with custom macro B",
        {"Call: G65 P9010 A4. B1. C0. - method, axis, tool.",
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
         "Common variables #100 to #199 and #500 to #999; 8-byte precision (0i-D: parameter 6008 bit 0 = 0); "
         "subprograms 10 "
         "deep; G53 ends the look-ahead; G31 with acceleration (parameter 6200 bit 7, SKF = 1), its skip signal the "
         "probe."});
    for (int i = 1; i <= 3; ++i) line(variable("main/" + std::to_string(i)) + "=[#" + std::to_string(i) + "+0]");
    for (int i = 0; i < 3; ++i) line("#" + std::to_string(110 + i) + "=#" + std::to_string(5041 + i));
  }
  void endSubprogram() override { line("M99"); }
  std::string comment(std::string_view text) const override { return "(" + plain(text) + ")"; }

  std::string variable(const std::string& name) override {
    if (const auto found = numbers_.find(name); found != numbers_.end()) return "#" + std::to_string(found->second);
    int& next = name.starts_with('_') || next_local_ > kLastLocal ? next_shared_ : next_local_;
    if (next > kLastShared) fail("more variables than the control has");
    numbers_[name] = next;
    return "#" + std::to_string(next++);
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
    line(kind == modbus::Kind::u16 ? "M98 P9040" : kind == modbus::Kind::f32 ? "M98 P9042" : "M98 P9041");
    const auto into = variable("read/" + std::to_string(reads_++ % 4));
    line(into + "=#102");
    return into;
  }
  void write(const Place& place, const std::string& value) override {
    const auto scale = number(1 / place.entry->scale);
    line("#102=" + (place.entry->scale == 1 ? value : operation(value, "*", scale)));
    line("#101=" + std::to_string(place.word));
    if (registersOf(place.entry->kind) == 2) return line("M98 P9043");
    line("#102=ROUND[#102]");
    line("#103=1");
    line("M98 P9040");
  }
  std::string position(char axis) override { return "#" + std::to_string(5021 + axes().letters.find(axis)); }
  std::string tool() const override { return "#4120"; }

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
    line("#3000=92 (PROBEBOX: SEE PROGRAM)");
  }
  void message(std::string_view text) override { comments(text); }

  void settings() override {
    line("G17 G21 G40 G49 G80");
    line("G90 G94 G61");
    line(comment("G59 IS THE MACHINE'S OWN COORDINATES, PLUS THE EXTERNAL OFFSET"));
    line("G10 L2 P6 X0 Y0 Z0");
    line("G59");
  }
  void wait(const std::string& seconds) override { line("G4 P[ROUND[1000*" + seconds + "]]"); }
  void settle() override { line("G53"); }
  void stop() override { line("M0"); }
  void takeTool(const std::string& number) override {
    line("T" + number + " M6");
    line("G49");
  }
  void turn(const std::map<char, std::string>& to) override {
    std::string words = "G0";
    for (const auto& [letter, value] : to) words += std::string{" "} + letter + value;
    line(words);
  }
  void move(const std::map<char, std::string>& to, const std::string& feed, bool guarded) override {
    for (const auto& [letter, value] : to) line("#" + std::to_string(110 + letter - 'X') + "=" + value);
    if (!feed.empty()) line("#113=" + feed);
    line(guarded ? "M98 P9044" : "G1 X#110 Y#111 Z#112 F#113");
  }

 private:
  std::map<std::string, int> programs_;
  std::map<std::string, int> numbers_;
  int next_local_{kFirstLocal}, next_shared_{kFirstShared};
  unsigned reads_{};
};

}  // namespace

std::unique_ptr<Writer> fanucWriter(Axes axes) {
  return std::make_unique<FanucWriter>(std::move(axes));
}

}  // namespace probebox::gcode::loop
