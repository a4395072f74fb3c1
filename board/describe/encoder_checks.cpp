#include "board/describe/encoder_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "board/describe/keys.hpp"

namespace probebox::board {
namespace {

// A reading may be late by so many of its intervals and still tell how often the counter has turned over.
constexpr double kIntervalsToSpare = 10;

// Facts of machine.toml about a linear or rotary axis.
struct AxisOfMachine {
  std::string section;  // "[axis.X]"
  std::string speed_key;
  ReferenceBy reference{};
  bool is_described{};
};

AxisOfMachine axisOf(const Machine& machine, std::size_t axis) {
  const std::string letter{kAllEncoderAxes[axis]};
  if (axis >= kEncoderLetters)
    return {"[axis." + letter + "]", "maximum_speed_mm_s", ReferenceBy::homing,
            machine.secondary_axes.at(axis - kEncoderLetters).has_value()};
  if (axis < kLinearEncoders)
    return {"[axis." + letter + "]", "maximum_speed_mm_s", machine.axes.at(axis).reference.by,
            letter != "Y" || machine.has_y};
  const auto& rotary = machine.rotary_axes.at(axis - kLinearEncoders);
  const bool counts = rotary && rotary->angle_from == AngleFrom::encoder;
  return {"[rotary_axis." + letter + "]", "maximum_speed_deg_s", counts ? rotary->reference : ReferenceBy::homing,
          counts};
}

class Findings {
 public:
  Findings(std::string box_file, std::string machine_file)
      : box_file_{std::move(box_file)}, machine_file_{std::move(machine_file)} {}

  void inBox(const EncoderDescription& encoder, std::size_t axis, const std::string& text) {
    found.push_back(box_file_ + ":" + std::to_string(encoder.line) + ": 'encoder." + kAllEncoderAxes[axis] + "' " +
                    text);
  }
  void inMachine(const std::string& text) { found.push_back(machine_file_ + ": " + text); }
  const std::string& machineFile() const { return machine_file_; }

  std::vector<std::string> found;

 private:
  std::string box_file_, machine_file_;
};

void checkReference(const EncoderDescription& encoder, std::size_t axis, const Box& box, const AxisOfMachine& described,
                    Findings& findings) {
  if (described.reference == ReferenceBy::absolute && !encoder.is_absolute)
    findings.inBox(encoder, axis,
                   "only counts, and " + findings.machineFile() + " says reference = \"absolute\" in " +
                       described.section +
                       ": write absolute = true if it tells its position after a restart, else reference = \"homing\" "
                       "or \"index\" there");
  const bool has_line = std::ranges::any_of(box.indexes, [&](const IndexLine& line) { return line.axis == axis; });
  if (described.reference == ReferenceBy::index && !has_line && !tellsIndex(encoder))
    findings.inBox(encoder, axis,
                   "has no index input, and " + findings.machineFile() + " says reference = \"index\" in " +
                       described.section + ": add an [[index]] line with axis = \"" + kEncoderAxes[axis] +
                       "\", or index = true where the counter reports it, or write reference = \"homing\" there");
}

void checkSpeed(const EncoderDescription& encoder, std::size_t axis, const Machine& machine,
                const AxisOfMachine& described, Findings& findings) {
  const double fastest_hz = fastestCounts_hz(machine, axis);
  const std::string remedy =
      "lower '" + described.speed_key + "' in " + described.section + " of " + findings.machineFile();
  if (const auto* const lines = std::get_if<QuadratureEncoder>(&encoder.by)) {
    if (fastest_hz > lines->maximum_edge_rate_hz)
      findings.inBox(encoder, axis,
                     "follows " + plain(lines->maximum_edge_rate_hz) + " edges/s, and its axis may make " +
                         plain(std::round(fastest_hz)) + ": " + remedy +
                         " to what it does, or count with a counter (kind = \"counter\")");
    return;
  }
  const auto* const counter = std::get_if<CounterEncoder>(&encoder.by);
  if (counter == nullptr || counter->bits == 0 || counter->bits >= 64) return;
  const double unread_s = longestUnread_s(std::exp2(counter->bits), fastest_hz);
  if (unread_s < kIntervalsToSpare / encoder.rate_hz)
    findings.inBox(encoder, axis,
                   "wraps after " + std::to_string(counter->bits) +
                       " bits, and at the highest speed of its axis half of "
                       "them pass in " +
                       plain(std::round(1e6 * unread_s) / 1e3) + " ms: read it at " +
                       plain(std::ceil(kIntervalsToSpare / unread_s)) + " Hz or more ('rate_hz'), or " + remedy);
}

}  // namespace

double fastestCounts_hz(const Machine& machine, std::size_t axis) {
  if (axis >= kEncoderLetters) {
    const auto& secondary = machine.secondary_axes.at(axis - kEncoderLetters);
    return secondary ? secondary->counts_per_mm * secondary->maximum_speed_mm_s : 0;
  }
  if (axis < kLinearEncoders) {
    const auto& linear = machine.axes.at(axis);
    return linear.counts_per_mm * linear.reference.maximum_speed_mm_s;
  }
  const auto& rotary = machine.rotary_axes.at(axis - kLinearEncoders);
  return rotary ? rotary->counts_per_deg * rotary->maximum_speed_deg_s : 0;
}

double longestUnread_s(double range, double fastest_counts_hz) {
  return fastest_counts_hz > 0 ? range / 2 / fastest_counts_hz : std::numeric_limits<double>::infinity();
}

std::vector<std::string> encoderProblems(const Box& box, const std::string& box_file, const Machine& machine,
                                         const std::string& machine_file) {
  if (box.devices.encoders != "axes") return {};
  Findings findings{box_file, machine_file};
  for (std::size_t axis = 0; axis < kAllEncoderAxes.size(); ++axis) {
    const auto& encoder = encoderOf(box.devices, axis);
    const auto described = axisOf(machine, axis);
    if (encoder && described.is_described) {
      checkReference(*encoder, axis, box, described, findings);
      checkSpeed(*encoder, axis, machine, described, findings);
    } else if (encoder) {
      findings.inBox(*encoder, axis,
                     "is read for nothing: add " + described.section +
                         (axis < kEncoderLetters ? " with angle_from = \"encoder\"" : "") + " to " + machine_file +
                         ", or remove it");
    } else if (axis >= kLinearEncoders && described.is_described) {
      const std::string missing =
          ", and " + box_file + " has no [encoder." + kAllEncoderAxes[axis] + "]: add it there, or ";
      findings.inMachine("'" + described.section + "' " +
                         (axis < kEncoderLetters
                              ? "has angle_from = \"encoder\"" + missing + "write angle_from = \"controller\""
                              : "is there" + missing + "remove it"));
    }
  }
  return findings.found;
}

}  // namespace probebox::board
