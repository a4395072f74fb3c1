#include "tools/gcode/loop/siemens.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tools/gcode/dialect.hpp"

namespace probebox::gcode::loop {
namespace {

constexpr int kFirstOfTable = 1000, kTable = 400;
constexpr unsigned kIndices = 3;  // more than one block has
const std::map<std::string_view, std::string_view, std::less<>> kRelations{{"EQ", "=="}, {"NE", "<>"}, {"LT", "<"},
                                                                           {"LE", "<="}, {"GT", ">"},  {"GE", ">="}};

class SiemensWriter final : public Writer {
 public:
  using Writer::Writer;

 protected:
  // Definitions come first and are known last: they stand in a file of their own behind the programs.
  void begin(const std::vector<Subprogram>&) override {}
  void end() override {
    moveGuarded();
    line("%_N_GUD8_DEF");
    line(";$PATH=/_N_DEF_DIR");
    line("; ACTIVATE IT ONCE, OR PUT ITS LINES INTO YOUR OWN GUD FILE");
    line("DEF CHAN REAL PB_N[" + std::to_string(kTable) + "]");
    for (unsigned i = 0; i < kIndices; ++i) line("DEF CHAN INT PB_INDEX_" + std::to_string(i));
    for (const auto& name : names_) line("DEF CHAN REAL " + name);
    line("M17");
  }
  void beginSubprogram(const Subprogram& one) override {
    const bool main = one.name == "main";
    const std::string name = main ? "PROBEBOX" : programOf(one.name);
    line("%_N_" + name + "_SPF");
    line(";$PATH=/_N_SPF_DIR");
    line("PROC " + name + (main ? "(REAL PB_OF_METHOD, REAL PB_OF_AXIS, REAL PB_OF_TOOL)" : ""));
    if (!main) return;
    explain("Siemens 840D sl or ONE",
            {"Call: PROBEBOX(4, 1, 0) - method, axis, tool. Put these programs where subprograms are found, and GUD8 "
             "into force.",
             "The PLC is the Modbus master of the box: MB_CLIENT of a S7-1500 (ONE), a CP 341 or an IM of a S7-300 "
             "(840D sl). Word "
             "N of the areas is byte 2 N of the memory that PLC and NC share ($A_DBW, $A_DBD, $A_DBR): FC 21 transfers "
             "it, by "
             "the type of each register. Register 0 read there is 20546.",
             "MEAS=1 is the probe at measuring input 1. Machine data: the alarm 65000 stops the program.",
             "Axes of the machine are named X Y Z A B C; G153 moves them without frames, D0 without tool lengths."});
    line(variable("main/1") + "=PB_OF_METHOD");
    line(variable("main/2") + "=PB_OF_AXIS");
    line(variable("main/3") + "=PB_OF_TOOL");
    for (const char axis : {'X', 'Y', 'Z'}) line(variable(target(axis)) + "=" + position(axis));
  }
  void endSubprogram() override { line("M17"); }
  std::string comment(std::string_view text) const override { return "; " + plain(text); }

  std::string variable(const std::string& name) override {
    std::string all = name.starts_with("_pb_") ? name.substr(1) : "pbl_" + name;
    for (char& c : all) c = c == '/' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    names_.insert(all);
    return all;
  }
  int placeOfTable(int number) const override { return number - kFirstOfTable; }
  // An index is an integer; assigning makes one of a real.
  std::string table(const std::string& index) override {
    if (index.find_first_not_of("0123456789") == std::string::npos) return "PB_N[" + index + "]";
    const std::string whole = "PB_INDEX_" + std::to_string(tables_++ % kIndices);
    line(whole + "=" + index);
    return "PB_N[" + whole + "]";
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
  std::string tool() const override { return "$P_TOOLNO"; }

  void assign(const std::string& target, const std::string& value) override { line(target + "=" + value); }
  void label(int number) override { line("LB" + std::to_string(number) + ":"); }
  void jump(int number) override { line("GOTO LB" + std::to_string(number)); }
  void jumpIf(const std::string& left, std::string_view relation, const std::string& right, int number) override {
    line("IF " + left + std::string{kRelations.find(relation)->second} + right + " GOTO LB" + std::to_string(number));
  }
  void callSubprogram(const std::string& name) override { line(programOf(name)); }
  void giveBack() override { line("M17"); }
  // The stop holds where the machine's alarms of this range do not.
  void abort(std::string_view text) override {
    line("MSG(\"" + plain(text) + "\")");
    line("SETAL(65000)");
    line("M0");
  }
  void message(std::string_view text) override { line("MSG(\"" + plain(text) + "\")"); }

  void settings() override {
    line("G17 G71 G40 D0");
    line("G90 G94 G60");
  }
  void wait(const std::string& seconds) override { line("G4 F=" + seconds); }
  void settle() override { line("STOPRE"); }
  void stop() override { line("M0"); }
  void takeTool(const std::string& number) override {
    line("T=" + number);
    line("M6");
    line("D0");
  }
  void turn(const std::map<char, std::string>& to) override {
    std::string words = "G0 G153";
    for (const auto& [letter, value] : to) words += std::string{" "} + letter + "=" + value;
    line(words);
  }
  void move(const std::map<char, std::string>& to, const std::string& feed, bool guarded) override {
    for (const auto& [letter, value] : to) line(variable(target(letter)) + "=" + value);
    if (!feed.empty()) line(variable("_pb_feed") + "=" + feed);
    line(guarded ? "PB_GO" : straight());
  }

 private:
  static std::string target(char axis) { return std::string{"_pb_to_"} + static_cast<char>(axis - 'X' + 'x'); }
  static std::string programOf(std::string_view name) {
    std::string all = "PB_" + std::string{name};
    std::ranges::transform(all, all.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return all;
  }
  static std::string straight() { return "G1 G153 X=PB_TO_X Y=PB_TO_Y Z=PB_TO_Z F=PB_FEED"; }
  void moveGuarded() {
    line("%_N_PB_GO_SPF");
    line(";$PATH=/_N_SPF_DIR");
    line("PROC PB_GO");
    line("; A MOVE THAT THE PROBE STOPS");
    line("MEAS=1 " + straight());
    line("STOPRE");
    line("IF $AC_MEA[1]==0 GOTO LB1");
    abort("PROBEBOX: THE PROBE TOUCHED ON THE WAY");
    line("LB1:");
    line("M17");
  }
  std::set<std::string> names_;
  unsigned tables_{};
};

}  // namespace

std::unique_ptr<Writer> siemensWriter(Axes axes) {
  return std::make_unique<SiemensWriter>(std::move(axes));
}

}  // namespace probebox::gcode::loop
