#pragma once
#include <map>
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
  // Method, axis, tool.
  virtual void call(double method, double axis, double tool) = 0;
  // Of a variable of the kit's program that all share, as its name there: "_pb_dry".
  virtual void set(const std::string& name, double value) = 0;
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
  void turnBy(const std::map<char, std::string>& words);
  double valueOf(std::string_view text) { return Formula{text, known_}.value(); }

  Control& control_;
  std::map<std::string, Lines> programs_;
  Formula::Known known_;
};

class FanucProgram final : public TextProgram {
 public:
  FanucProgram(Control& control, std::string_view text);
  void call(double method, double axis, double tool) override;
  void set(const std::string& name, double value) override { preset_[name] = value; }
  double get(const std::string& name) const override;

 private:
  bool isLabel(const std::string& line, const std::string& label) const override { return line == "N" + label; }
  std::string line(const std::string& text) override;
  void block(const std::string& text);
  double read(int number);
  void write(int number, double value);

  std::map<int, double> variables_;
  std::map<std::string, double> preset_;
  std::map<std::string, int> numbers_;  // of names, as the program lists them
};

class SiemensProgram final : public TextProgram {
 public:
  SiemensProgram(Control& control, std::string_view text);
  void call(double method, double axis, double tool) override;
  void set(const std::string& name, double value) override { preset_[name] = value; }
  double get(const std::string& name) const override;

 private:
  bool isLabel(const std::string& line, const std::string& label) const override { return line == label + ":"; }
  std::string line(const std::string& text) override;
  void block(const std::string& text);
  double read(const std::string& name, double index);
  void write(const std::string& target, double value);

  std::map<std::string, double> variables_;
  std::map<std::string, double> preset_;
  std::set<std::string> whole_;  // integers
  std::map<int, double> table_;
  double touched_{};
};

}  // namespace probebox::scenario
