#pragma once
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/loop/areas.hpp"
#include "tools/gcode/loop/program_text.hpp"

namespace probebox::gcode::loop {

// Properties of the control that the loop program depends on.
struct Axes {
  std::string letters{"XYZABC"};  // as the control numbers its axes, from 1; axes that are not here are not moved
  bool lathe{};                   // a turret, X programmed in diameters, G-code system A of a Fanuc
};

// Writes the loop program in the language of one control. Flow becomes labels and jumps, which all of them have; a
// dialect says how each is written.
class Writer {
 public:
  explicit Writer(Axes axes) : axes_{std::move(axes)} {}
  virtual ~Writer() = default;

  // All subprograms. The first one is the program that is called.
  Outcome<std::string> write(const std::vector<Subprogram>& subprograms);

 protected:
  // Write the text of the file before the first and after the last subprogram.
  virtual void begin(const std::vector<Subprogram>& subprograms) = 0;
  virtual void end() = 0;
  virtual void beginSubprogram(const Subprogram& subprogram) = 0;
  virtual void endSubprogram() = 0;
  virtual std::string comment(std::string_view text) const = 0;
  virtual std::string variable(const std::string& name) = 0;
  // Where the place of that number (1000 to 1399) of a table is in the control, and what is there.
  virtual int placeOfTable(int number) const = 0;
  virtual std::string table(const std::string& index) = 0;
  // How comments name a subprogram, and the place of a table: "1 + number of a tool".
  virtual std::string programNamed(const std::string& subprogram) = 0;
  virtual std::string placeSaid(int first, const std::string& rest) const = 0;
  virtual std::string number(double value) const;
  virtual std::string call(const std::string& function, const std::string& argument) const = 0;
  virtual std::string operation(const std::string& left, std::string_view sign, const std::string& right) const = 0;
  virtual std::string remainder(const std::string& left, const std::string& right) const = 0;
  // Gives what stands for a register or a position in a value; a dialect may write lines before that.
  virtual std::string read(const Place& place) = 0;
  virtual void write(const Place& place, const std::string& value) = 0;
  virtual std::string position(char axis) = 0;                         // in the machine's own coordinates
  virtual std::string commanded(char axis) { return position(axis); }  // as moves name it
  virtual std::string tool() = 0;  // number of the tool in the spindle, as the control reports it
  // The same where that is certain; otherwise a number that no tool has.
  virtual std::string toolForSure() { return tool(); }
  // Flow.
  virtual void assign(const std::string& target, const std::string& value) = 0;
  virtual void label(int number) = 0;
  virtual void jump(int number) = 0;
  virtual void jumpIf(const std::string& left, std::string_view relation, const std::string& right, int number) = 0;
  virtual void callSubprogram(const std::string& name) = 0;
  virtual void giveBack() = 0;
  virtual void abort(std::string_view text) = 0;
  virtual void message(std::string_view text) = 0;
  // Blocks.
  virtual void settings() = 0;  // modes, and the machine's own coordinates
  virtual void wait(const std::string& seconds) = 0;
  virtual void settle() = 0;  // the program does not run ahead of the motion
  virtual void stop() = 0;
  virtual void orient() = 0;  // the spindle, to its one place
  virtual void takeTool(const std::string& number) = 0;
  enum class Turn { freely, until_touched };
  // At rapid without a feed, which is in degrees a minute.
  virtual void turn(const std::map<char, std::string>& to, const std::string& feed, Turn how) = 0;
  // centre: from where it begins, along X and Y.
  virtual void arc(const std::map<char, std::string>& to, const std::array<std::string, 2>& centre,
                   const std::string& feed, bool clockwise) = 0;
  // guarded: stops the program where the probe touches.
  virtual void move(const std::map<char, std::string>& to, const std::string& feed, bool guarded) = 0;

  // To where the probe touches, which is no alarm.
  virtual void seek(const std::map<char, std::string>& to, const std::string& feed) = 0;

  void line(const std::string& text) { text_ += text + "\n"; }
  void comments(std::string_view kits);
  const Axes& axes() const { return axes_; }
  bool has(char axis) const { return axes_.letters.find(axis) != std::string::npos; }
  // The letters of the linear axes that the control has.
  std::string linearAxes() const;
  void fail(const std::string& what);
  int newLabel() { return ++labels_; }
  std::string text(const Value& value);
  // Writes as comments what an integrator has to know and to do.
  void explain(std::string_view control, const std::vector<std::string>& needs);
  // Assigns the copies of the registers of the step.
  void look();
  // The step's registers by which a torn copy is recognised.
  static const std::vector<std::string>& headOfStep();
  static std::string copyOf(std::string_view pin);  // name of its variable

 private:
  void body(const std::vector<Statement>& statements);
  void statement(const Statement& statement);
  void assignment(const Statement& statement);
  void choice(const Statement& statement);
  void repeat(const Statement& statement);
  int rotaryAxes() const;
  std::optional<double> knownByAxes(std::string_view name) const;
  void block(const Statement& statement);
  static bool isSetting(const Statement& statement);
  void motion(const Statement& statement, const std::map<char, std::string>& words, Turn how);
  void circle(const std::map<char, std::string>& words, bool clockwise);
  void jumpUnless(const Value& condition, int label);
  void jumpUnlessRelation(const Value& condition, int label);
  void gather(const Value& value);
  void gather(const std::vector<Statement>& statements);
  bool shift(Value& index) const;
  std::string said(std::string_view kits);

  Axes axes_;
  std::string text_;
  std::string owner_;
  int labels_{};
  std::vector<int> loops_;  // labels behind the loops that are open
  int end_label_{};
  bool pressing_{};  // the probe is meant to touch
  std::map<std::string, const Subprogram*> by_name_;
  std::set<std::string> step_pins_;
  std::optional<Error> failure_;
};

}  // namespace probebox::gcode::loop
