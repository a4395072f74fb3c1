#pragma once
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "control.hpp"
#include "formula.hpp"

namespace probebox::scenario {

// Runs the written text of a loop program. What is beyond the subset stops it with an alarm.
class TextProgram {
 public:
  explicit TextProgram(Control& control) : control_{control} {}
  virtual ~TextProgram() = default;
  // Method, axis, tool, read by, mounts, contacts; what is left out at the end is 0.
  virtual void call(const std::vector<double>& arguments) = 0;
  // Of a variable of the kit's program that all share, as its name there: "_pb_dry".
  virtual void set(const std::string& name, double value) = 0;
  // The same of a place of the tables, by the kit's number.
  void setTable(int number, double value) { preset_table_[number] = value; }
  // The same of any variable, as it is now: "main/came".
  virtual double get(const std::string& name) const = 0;
  std::string last;  // line that was done last

 protected:
  using Lines = std::vector<std::string>;
  void run(const std::string& name);
  virtual bool isLabel(const std::string& line, const std::string& label) const = 0;
  // Does a line. "->LABEL" to go on there, "return", or nothing.
  virtual std::string line(const std::string& text) = 0;
  // Axes that have no word stay.
  void turnBy(const std::map<char, std::string>& words, double feed_deg_min = 0);
  // From the present work coordinates of X Y Z A B C to those of the machine.
  virtual double shiftOf(std::size_t) const { return 0; }
  double valueOf(std::string_view text) { return Formula{text, known_}.value(); }

  Control& control_;
  std::map<int, double> preset_table_;
  int depth_{};  // of subprograms in each other
  std::map<std::string, Lines> programs_;
  Formula::Known known_;
};

// letters: the axes as the control numbers them. A lathe has G-code system A, X in diameters.
class FanucProgram final : public TextProgram {
 public:
  FanucProgram(Control& control, std::string_view text, std::string letters, bool is_lathe);
  void call(const std::vector<double>& arguments) override;
  void set(const std::string& name, double value) override { preset_[name] = value; }
  double get(const std::string& name) const override;

  // The state in which the caller has the control: nothing is as the program needs it.
  std::map<int, double> modal{{4002, 18}, {4003, 91}, {4005, 95}, {4006, 21}, {4007, 40}, {4008, 43}, {4009, 80},
                              {4011, 50}, {4014, 55}, {4015, 64}, {4016, 69}, {4022, 50}, {4130, 0}};
  static constexpr int kFurther = 100;  // in `offsets`, G54.1 P1
  std::map<int, std::array<double, 6>> offsets{{54, {-310, -205, -410}},
                                               {55, {-300, -200, -400, 10, 20, 30}},
                                               {59, {1, 2, 3}},
                                               {kFurther + 47, {7, -8, 9, 3, 4, 5}}};
  std::array<double, 6> local{};                  // G52
  double length{80};                              // mm, of the offset that is active where #4008 is 43
  std::optional<double> commanded_tool;           // #4120, where it is not the one in the spindle
  double tool_offset{};                           // of a lathe: the last two digits of T
  static constexpr int kToolOfTheBuilder = 1032;  // variable that has the tool in the spindle

 private:
  bool isLabel(const std::string& line, const std::string& label) const override { return line == "N" + label; }
  std::string line(const std::string& text) override;
  void block(const std::string& text);
  void takeTool(unsigned number);
  void turnTurret(unsigned word);
  double shiftOf(std::size_t axis) const override;
  // Of a position in mm or degrees: X of a lathe is in diameters.
  double inWords(char axis, double at) const { return is_lathe_ && axis == 'X' ? 2 * at : at; }
  double outOfWords(char axis, double word) const { return is_lathe_ && axis == 'X' ? word / 2 : word; }
  std::array<double, 3> placeIn(const std::map<char, std::string>& words);
  double read(int number);
  void write(int number, double value);

  std::string letters_;
  bool is_lathe_;
  std::string first_;  // program that is called
  std::map<int, double> variables_;
  std::map<std::string, double> preset_;
  std::map<std::string, int> numbers_;  // of names, as the program lists them
};

class SiemensProgram final : public TextProgram {
 public:
  SiemensProgram(Control& control, std::string_view text, bool has_y, bool is_lathe);
  void call(const std::vector<double>& arguments) override;
  void set(const std::string& name, double value) override { preset_[name] = value; }
  double get(const std::string& name) const override;

  // The state in which the caller has the control: plane, units, absolute, feed, exact stop, D; of a lathe whether X is
  // in diameters.
  std::map<char, double> modes{{'P', 18}, {'U', 70}, {'A', 91}, {'F', 95}, {'S', 64}, {'D', 1}};
  double transformation{};  // $AC_TRAFO

 private:
  bool isLabel(const std::string& line, const std::string& label) const override { return line == label + ":"; }
  std::string line(const std::string& text) override;
  void block(const std::string& text);
  double read(const std::string& name, double index);
  void write(const std::string& target, double value);

  std::map<std::string, double> variables_;
  std::map<std::string, double> preset_;
  std::vector<std::string> parameters_;
  std::set<std::string> whole_;  // integers
  std::map<int, double> table_;
  std::vector<double> locals_;          // PBL_N
  std::map<std::string, int> numbers_;  // in it, of names, as the program lists them
  double touched_{};
  bool saves_{}, has_y_, is_lathe_;
};

}  // namespace probebox::scenario
