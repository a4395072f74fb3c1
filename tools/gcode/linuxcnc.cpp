#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {
namespace {

class LinuxCnc final : public Dialect {
 public:
  std::string_view name() const override { return "linuxcnc"; }
  std::string_view control() const override { return "LinuxCNC 2.9"; }
  std::string_view tried() const override {
    return "The tests read it with LinuxCNC's own interpreter, rs274. No machine was moved by it.";
  }
  std::string_view leaves() const override {
    return "G54, G90, G91.1, G94, G64. After an abort: G61.1 in place of G64, and the mask of the probe off after 20 "
           "s.";
  }
  Lines needs(Marks marks) const override {
    if (marks == Marks::stops) return {};
    return {"The box's tape: face on the serial line that LOGAPPEND names.",
            "M66 P0 L0 before each line keeps the interpreter from running ahead of the motion."};
  }
  Lines guardNeeds() const override {
    return {
        "The probe on motion.probe-input by way of probebox-probe, see tools/linuxcnc/probebox_measure.hal. M64 P0 "
        "masks it while a step presses it into the surface, for 20 s at most. Without it LinuxCNC aborts there."};
  }
  std::string_view guardWord() const override { return "G38.3"; }
  bool hasTipControl() const override { return false; }

  Lines head(std::string_view title, std::uint32_t) const override { return {"%", comment(title)}; }
  Lines modes() const override { return {"G17 G21 G40 G54 G80 G90 G91.1 G94 G61.1"}; }
  Lines start(Marks marks, std::string_view device) const override {
    Lines lines{"o<pb_clear> sub",
                "o<pb_touched> if [#5070 EQ 1]",
                "(ABORT,TOUCHED ON THE WAY)",
                "o<pb_touched> endif",
                "o<pb_clear> endsub",
                "o<pb_length> sub",
                "o<pb_none> if [[#<_tool_offset> EQ 0] OR [#5403 EQ 0]]",
                "(ABORT,NO LENGTH OFFSET ACTIVE)",
                "o<pb_none> endif",
                "o<pb_length> endsub",
                modes().front(),
                "M5",
                "M9",
                "o<pb_rotated> if [#5230 NE 0]",
                "(ABORT,CANCEL THE ROTATION OF G54: G10 L2 P1 R0)",
                "o<pb_rotated> endif",
                "o<pb_shifted> if [#5210 NE 0]",
                "(ABORT,CANCEL THE SHIFT: G92.1)",
                "o<pb_shifted> endif"};
    if (marks == Marks::lines)
      lines.push_back("(LOGAPPEND," + std::string{device.empty() ? "/dev/ttyS1" : device} + ")");
    return lines;
  }
  Lines end(Marks marks) const override {
    if (marks == Marks::stops) return {"G64", "M2", "%"};
    return {"(LOGCLOSE)", "G64", "M2", "%"};
  }
  // Q: time that it may take; without it the program goes on at once.
  std::string orient(double angle_deg) const override { return Dialect::orient(angle_deg) + " Q20"; }
  Lines guarded(const Move& move) const override {
    return {"G38.3" + placeWords(move) + " F" + decimal(move.feed_mm_min), "o<pb_clear> call"};
  }
  Lines seek(const Move& move) const override {
    return {"G38.2" + placeWords(move) + " F" + decimal(move.feed_mm_min)};
  }
  Lines takeLength(const Move& move) const override {
    return {"G43 H" + std::to_string(move.length->tool), "o<pb_length> call", Dialect::move(move)};
  }
  Lines retract(const Retract&, double machine_z_mm) const override { return {"G53 G0 Z" + decimal(machine_z_mm)}; }
  Lines checkLength() const override { return {"o<pb_length> call"}; }
  Lines contact(const Contact& contact) const override {
    if (contact.renews) return {"M66 P0 L0", "M65 P0", "M64 P0"};
    // Free again when the axes stand: in front of that it would be a touch on the way.
    return contact.begin ? Lines{"M64 P0"} : Lines{"M66 P0 L0", "M65 P0"};
  }
  std::optional<double> mask_s() const override { return 18; }  // of the 20 s of probebox_requests.hal
  Lines stop(const Stop& stop) const override { return {"(MSG," + plain(stop.text) + ")", "M0"}; }
  Lines mark(const Mark& mark) const override {
    const auto& [a, b, c] = mark.angles_deg;
    return {"M66 P0 L0", "(LOG," + nameOf(mark) + std::to_string(mark.step) + " A" + decimal(a) + " B" + decimal(b) +
                             " C" + decimal(c) + " T" + std::to_string(mark.tool) + " F" + decimal(mark.speed_mm_s) +
                             ")"};
  }

 private:
  std::string_view lathe() const override { return "G7, G8"; }
};

}  // namespace

const Dialect& linuxcnc() {
  static const LinuxCnc one;
  return one;
}

}  // namespace probebox::gcode
