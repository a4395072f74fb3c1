#include "tools/gcode/loop/siemens.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tools/gcode/dialect.hpp"
#include "tools/gcode/loop/locals.hpp"

namespace probebox::gcode::loop {
namespace {

constexpr int kFirstOfTable = 1000, kTable = 400;
// Names are distinct by their beginnings: programs PB_, helpers PBH_, arguments PBP_, variables PBV_, the array of all
// others PBL_, the table PBT_.
constexpr std::string_view kTableName = "PBT_N", kLocals = "PBL_N";
constexpr const char* kLathes =
    " It moves X in radius (DIAMOF), in which the places below are; SAVE gives DIAMON back. T turns the turret without "
    "an "
    "M6 (MD 22550 TOOL_CHANGE_MODE = 0), with Z at the safe height, wherever X is: nothing that it carries may reach "
    "anything there. The main spindle stands and is axis C before the call, as your builder switches it, its brake "
    "released.";
constexpr std::array<std::string_view, 6> kArguments{"METHOD", "AXIS", "TOOL", "READ_BY", "MOUNTS", "CONTACTS"};
constexpr unsigned kIndices = 3;  // more than one block has
const std::map<std::string_view, std::string_view, std::less<>> kRelations{{"EQ", "=="}, {"NE", "<>"}, {"LT", "<"},
                                                                           {"LE", "<="}, {"GT", ">"},  {"GE", ">="}};

class SiemensWriter final : public Writer {
 public:
  using Writer::Writer;

 protected:
  // Definitions come first and are known last: they stand in a file of their own behind the programs.
  void begin(const std::vector<Subprogram>& subprograms) override {
    for (const auto& [name, place] : placesOfLocals(subprograms)) {
      numbers_[name] = place;
      next_ = std::max(next_, place + 1);
    }
    for (const auto& one : subprograms) {
      if (one.name != "places") continue;
      for (const auto& statement : one.body) {
        if (statement.is == Statement::Is::assign && statement.values[0].is == Value::Is::variable)
          named_.insert(statement.values[0].name);
      }
    }
  }
  void end() override {
    moveGuarded();
    modes();
    const std::size_t names = names_.size() + kIndices + 2;
    const std::size_t bytes = 8 * (kTable + next_ + names_.size()) + 4 * kIndices;
    line("%_N_GUD8_DEF");
    line(";$PATH=/_N_DEF_DIR");
    comments(
        "Activate it once, or put its lines into your own GUD file. Save an archive before: the control sets its "
        "memory up anew where these machine data change (on an 828D they can only be read).");
    comments("MD 18118 MM_NUM_GUD_MODULES: 8 at least, or the file that you put it into");
    comments("MD 18130 MM_NUM_GUD_NAMES_CHAN: " + std::to_string(names) + " more than now");
    comments("MD 18150 MM_GUD_VALUES_MEM: " + std::to_string(bytes / 1024 + 1) +
             " more than now for each channel, in kB");
    line("DEF CHAN REAL " + std::string{kTableName} + "[" + std::to_string(kTable) + "]");
    line("DEF CHAN REAL " + std::string{kLocals} + "[" + std::to_string(next_) + "]");
    for (unsigned i = 0; i < kIndices; ++i) line("DEF CHAN INT PBT_INDEX_" + std::to_string(i));
    for (const auto& name : names_) line("DEF CHAN REAL " + name);
    for (const auto& [name, number] : numbers_) line(comment(placed(number) + " " + name));
    line("M17");
  }
  void beginSubprogram(const Subprogram& one) override {
    const bool main = one.name == "main";
    const std::string name = main ? "PROBEBOX" : programOf(one.name);
    line("%_N_" + name + "_SPF");
    line(";$PATH=/_N_SPF_DIR");
    subprogram_ = one.name;
    line("PROC " + name + (main ? "(" + parameters() + ") SAVE" : ""));
    if (!main) return;
    const std::string held = axes().lathe ? "in the turret" : "in the spindle";
    explain(
        axes().lathe ? "lathes: Siemens 840D sl or ONE" : "Siemens 840D sl or ONE",
        {"Call: PROBEBOX(4, 1, 0) - method, axis, tool, read by, mounts, contacts; what is left out at the end is "
         "0. The program that calls it has in its head: EXTERN PROBEBOX(REAL, REAL, REAL, REAL, REAL, REAL). Put "
         "these programs where subprograms are found, and GUD8 into force: its head has the machine data that it "
         "needs.",
         std::string{
             "At its end it gives back the G functions and frames of the caller (SAVE), and D where the tool "} +
             held +
             " is still his. It leaves behind: after another tool D0 (call D before Z moves), coolant off (M9), the "
             "tool of the last step " +
             held +
             ", Z at the safe height. An alarm of this program is left by reset, "
             "which gives back G functions, frames and D as the machine data of your reset state have them.",
         "No transformation may be active (TRAORI, TRANSMIT, TRACYL): it refuses to begin.",
         "The PLC is the Modbus master of the box: MB_CLIENT of a S7-1500 (ONE), a CP 341 or an IM of a S7-300 "
         "(840D sl). Word "
         "N of the areas is byte 2 N of the memory that PLC and NC share ($A_DBW, $A_DBD, $A_DBR): FC 21 transfers "
         "it, by "
         "the type of each register. Register 0 read there is 20546.",
         "MEAS=1 is the probe at measuring input 1. Machine data: the alarm 65000 stops the program.",
         "Axes of the machine are named X Y Z A B C; G153 moves them without frames, D0 without tool lengths." +
             std::string{axes().lathe ? kLathes : ""},
         "C counts on beyond 360 degrees and below 0: it is no modulo axis (MD 30310 ROT_IS_MODULO = 0). The program "
         "writes plain C=, which on a modulo axis never passes 0: there a turn until contact near 0, or the way back "
         "from it, would go the long way round."});
    for (std::size_t i = 0; i < kArguments.size(); ++i)
      line(variable("main/" + std::to_string(i + 1)) + "=PBP_" + std::string{kArguments[i]});
    line("STOPRE");
    line(variable("_pb_kept_tool") + "=" + tool());
    line(variable("_pb_kept_d") + "=$P_TOOL");
    const int free = newLabel();
    jumpIf("$AC_TRAFO", "EQ", "0", free);
    abort("PROBEBOX: CANCEL THE TRANSFORMATION: TRAFOOF");
    label(free);
  }
  void endSubprogram() override {
    if (subprogram_ == "main") {
      const int other = newLabel();
      line("STOPRE");
      jumpIf(tool(), "NE", variable("_pb_kept_tool"), other);
      line("D=" + variable("_pb_kept_d"));
      label(other);
    }
    line("M17");
  }
  // Brackets stay: comments name places of the table.
  std::string comment(std::string_view text) const override {
    std::string all = "; ";
    for (const char c : text) {
      if (c >= ' ' && c <= '~' && c != '"') all += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    return all;
  }

  std::string variable(const std::string& name) override {
    if (!named_.contains(name)) {
      const auto [found, is_new] = numbers_.emplace(name, next_);
      next_ += is_new ? 1 : 0;
      return placed(found->second);
    }
    std::string all = "PBV_" + name.substr(4);
    std::ranges::transform(all, all.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    names_.insert(all);
    return all;
  }
  std::string programNamed(const std::string& subprogram) override { return programOf(subprogram); }
  std::string placeSaid(int first, const std::string& rest) const override {
    return std::string{kTableName} + "[" + std::to_string(first) + " + " + rest + "]";
  }
  int placeOfTable(int number) const override { return number - kFirstOfTable; }
  // An index is an integer; assigning makes one of a real.
  std::string table(const std::string& index) override {
    if (index.find_first_not_of("0123456789") == std::string::npos) return std::string{kTableName} + "[" + index + "]";
    const std::string whole = "PBT_INDEX_" + std::to_string(tables_++ % kIndices);
    line(whole + "=" + index);
    return std::string{kTableName} + "[" + whole + "]";
  }
  std::string call(const std::string& function, const std::string& argument) const override {
    return (function == "FIX" ? "TRUNC" : function) + (argument.starts_with('(') ? argument : "(" + argument + ")");
  }
  std::string operation(const std::string& left, std::string_view sign, const std::string& right) const override {
    return "(" + left + std::string{sign} + right + ")";
  }
  std::string remainder(const std::string& left, const std::string& right) const override {
    return "(" + left + "-" + right + "*TRUNC(" + left + "/" + right + "))";
  }

  std::string read(const Place& place) override {
    const auto at = "[" + std::to_string(2 * place.word) + "]";
    if (place.entry->kind == modbus::Kind::u16) return "($A_DBW" + at + " B_AND 65535)";
    return (place.entry->kind == modbus::Kind::f32 ? "$A_DBR" : "$A_DBD") + at;
  }
  void write(const Place& place, const std::string& value) override {
    const auto at = "[" + std::to_string(2 * place.word) + "]";
    const auto counts = place.entry->scale == 1 ? value : operation(value, "*", number(1 / place.entry->scale));
    line((registersOf(place.entry->kind) == 2 ? "$A_DBD" : "$A_DBW") + at + "=ROUND(" + counts + ")");
  }
  std::string position(char axis) override { return std::string{"$AA_IM["} + axis + "]"; }
  std::string tool() override { return "$P_TOOLNO"; }

  void assign(const std::string& target, const std::string& value) override { line(target + "=" + value); }
  void label(int number) override { line("LB" + std::to_string(number) + ":"); }
  void jump(int number) override { line("GOTO LB" + std::to_string(number)); }
  void jumpIf(const std::string& left, std::string_view relation, const std::string& right, int number) override {
    line("IF " + left + std::string{kRelations.find(relation)->second} + right + " GOTO LB" + std::to_string(number));
  }
  void callSubprogram(const std::string& name) override { line(programOf(name)); }
  void giveBack() override { line("M17"); }
  // The stop holds where the machine's alarms of this range do not, and start does not go on behind it.
  void abort(std::string_view text) override {
    line("MSG(\"" + plain(text) + "\")");
    line("SETAL(65000)");
    const int again = newLabel();
    label(again);
    line("M0");
    jump(again);
  }
  void message(std::string_view text) override { line("MSG(\"" + plain(text) + "\")"); }

  void settings() override { line("PBH_MODES"); }
  void wait(const std::string& seconds) override { line("G4 F=" + seconds); }
  void settle() override { line("STOPRE"); }
  void orient() override { line("SPOS=0"); }
  void stop() override { line("M0"); }
  void takeTool(const std::string& number) override {
    line("T=" + number);
    if (!axes().lathe) line("M6");
  }
  void turn(const std::map<char, std::string>& to, const std::string& feed, Turn how) override {
    const bool until_touched = how == Turn::until_touched;
    std::string words = until_touched ? "MEAS=1 G1 G153" : feed.empty() ? "G0 G153" : "G1 G153";
    for (const auto& [letter, value] : to) words += std::string{" "} + letter + "=" + value;
    line(words + (feed.empty() ? "" : " F=" + feed));
    if (until_touched) line("STOPRE");
  }
  void arc(const std::map<char, std::string>& to, const std::array<std::string, 2>& centre, const std::string& feed,
           bool clockwise) override {
    for (const auto& [letter, value] : to) line(variable(target(letter)) + "=" + value);
    line(variable("_pb_feed") + "=" + feed);
    line(variable("_pb_to_i") + "=" + centre[0]);
    line(variable("_pb_to_j") + "=" + centre[1]);
    line(std::string{clockwise ? "G2" : "G3"} + " G153 X=PBV_TO_X Y=PBV_TO_Y I=PBV_TO_I J=PBV_TO_J F=PBV_FEED");
  }
  void move(const std::map<char, std::string>& to, const std::string& feed, bool guarded) override {
    for (const auto& [letter, value] : to) line(variable(target(letter)) + "=" + value);
    if (!feed.empty()) line(variable("_pb_feed") + "=" + feed);
    line(guarded ? "PBH_GO" : straight());
  }
  void seek(const std::map<char, std::string>& to, const std::string& feed) override {
    for (const auto& [letter, value] : to) line(variable(target(letter)) + "=" + value);
    line(variable("_pb_feed") + "=" + feed);
    line("MEAS=1 " + straight());
    line("STOPRE");
  }

 private:
  static std::string parameters() {
    std::string all;
    for (const auto name : kArguments) all += (all.empty() ? "REAL PBP_" : ", REAL PBP_") + std::string{name};
    return all;
  }
  static std::string target(char axis) { return std::string{"_pb_to_"} + static_cast<char>(axis - 'X' + 'x'); }
  static std::string programOf(std::string_view name) {
    std::string all = "PB_" + std::string{name};
    std::ranges::transform(all, all.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return all;
  }
  std::string straight() const {
    std::string words = "G1 G153";
    for (const char axis : linearAxes()) words += std::string{" "} + axis + "=PBV_TO_" + axis;
    return words + " F=PBV_FEED";
  }
  // Also where the machine stands: a move of one axis leaves the others there.
  void modes() {
    line("%_N_PBH_MODES_SPF");
    line(";$PATH=/_N_SPF_DIR");
    line("PROC PBH_MODES");
    line("; MODES, NO LENGTH, NO TRANSFORMATION. G153 OF EACH MOVE IS THE MACHINE'S FRAME");
    line(std::string{has('Y') ? "G17" : "G18"} + " G710 G40");
    line("G90 G94 G60");
    if (axes().lathe) line("DIAMOF");
    line("M9");
    line("TRAFOOF");
    line("D0");
    line("STOPRE");
    for (const char axis : linearAxes()) line(variable(target(axis)) + "=" + position(axis));
    line("M17");
  }
  void moveGuarded() {
    line("%_N_PBH_GO_SPF");
    line(";$PATH=/_N_SPF_DIR");
    line("PROC PBH_GO");
    line("; A MOVE THAT THE PROBE STOPS");
    line("MEAS=1 " + straight());
    line("STOPRE");
    const int free = newLabel();
    jumpIf("$AC_MEA[1]", "EQ", "0", free);
    abort("PROBEBOX: THE PROBE TOUCHED ON THE WAY");
    label(free);
    line("M17");
  }
  static std::string placed(std::size_t number) { return std::string{kLocals} + "[" + std::to_string(number) + "]"; }

  std::string subprogram_;
  // Variables that a person reads or edits, and those of the helpers; the others have numbers in one array.
  std::set<std::string> named_{"_pb_why", "_pb_feed", "_pb_to_x", "_pb_to_y", "_pb_to_z", "_pb_to_i", "_pb_to_j"};
  std::set<std::string> names_;  // of those, as they are written
  std::map<std::string, std::size_t> numbers_;
  std::size_t next_{};
  unsigned tables_{};
};

}  // namespace

std::unique_ptr<Writer> siemensWriter(Axes axes) {
  return std::make_unique<SiemensWriter>(std::move(axes));
}

}  // namespace probebox::gcode::loop
