#include <array>
#include <cstdio>

#include "tools/gcode/macro_b.hpp"

namespace probebox::gcode {
namespace {

class Haas final : public MacroB {
 public:
  std::string_view name() const override { return "haas"; }
  std::string_view control() const override { return "Haas NGC with macros"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::string_view leaves() const override {
    return "G52 at zero, G50, G69, G54, G90, G94, G64, the look-ahead as usual (G103). After an alarm: G103 P1, until "
           "reset or G103.";
  }
  Lines needs(Marks marks) const override {
    constexpr const char* kMacros = "The macro option. Local variables #1 to #6 are overwritten, no global ones.";
    if (marks == Marks::stops) return {kMacros};
    return {kMacros,
            "NGC: setting 261 on TCP port, its number in setting 263. The control listens there: a serial device "
            "server in TCP client mode connects to it, its RS-232 wired to the box's tape: face. Setting 262 names a "
            "file and is not used.",
            "Controls before NGC: DPRNT goes to their RS-232, wired to the box's tape: face.",
            "G103 P1 limits the look-ahead, the empty blocks let the motion end before a line is printed."};
  }
  Lines guardNeeds() const override {
    return {"M78 in a G31 block is the alarm when the probe touches, M79 that when it does not."};
  }
  Lines head(std::string_view title, std::uint32_t number) const override {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "O%05u ", number);
    return {"%", text.data() + comment(title)};
  }
  Lines modes() const override { return {"G17 G21 G40 G80", "G50", "G69", "G54 G90 G94 G61"}; }
  Lines start(Marks, std::string_view) const override {
    Lines lines = modes();
    lines.insert(lines.end(), {"M5", "M9", "G103 P1"});
    const Lines clear = cleared();
    lines.insert(lines.end(), clear.begin(), clear.end());
    return lines;
  }
  Lines end(Marks) const override { return {"G103", "G64", "M30", "%"}; }
  Lines guarded(const Move& move) const override {
    return {"G31" + placeWords(move) + " F" + decimal(move.feed_mm_min) + " M78"};
  }
  Lines seek(const Move& move) const override {
    return {"G31" + placeWords(move) + " F" + decimal(move.feed_mm_min) + " M79"};
  }
  Lines mark(const Mark& mark) const override { return printed(mark, {";", ";"}); }

 private:
  std::string_view lathe() const override { return "lathe codes"; }
  std::string_view tipControl() const override { return "G234"; }
};

}  // namespace

const Dialect& haas() {
  static const Haas one;
  return one;
}

}  // namespace probebox::gcode
