#include "protocol/modbus/result_blocks.hpp"

#include "protocol/units/result_keys.hpp"

namespace probebox::modbus {
namespace {

using enum ValueUnit;

constexpr BlockValue kFromTip[]{{"X", mm, {{{result_key::kCentre, 0}}}}, {"Y", mm, {{{result_key::kCentre, 1}}}}};
// Where C was read at one height alone there is no slope, and of a lathe of X and Z no Y.
constexpr BlockValue kAxis[]{{"X", mm, {{{result_key::kCentre, 0}, {result_key::kCentreX, 0}}}},
                             {"Y", mm, {{{result_key::kCentre, 1}}}},
                             {"X over Z", rad, {{{result_key::kCTilt, 0}, {result_key::kCTiltX, 0}}}},
                             {"Y over Z", rad, {{{result_key::kCTilt, 1}}}},
                             {"reference Z", mm, {{{result_key::kMeanHeight, 0}}}}};
constexpr BlockValue kOffset[]{{"X", mm, {{{result_key::kOffsetCMinusA, 0}}}},
                               {"Y", mm, {{{result_key::kOffsetCMinusA, 1}}}}};
constexpr BlockValue kSpindleTilt[]{{"X over Z", rad, {{{result_key::kSpindleTilt, 0}}}},
                                    {"Y over Z", rad, {{{result_key::kSpindleTilt, 1}}}}};
// A result is about one plane, and has two of the coordinates.
constexpr BlockValue kPivot[]{{"X", mm, {{{result_key::kPivotXz, 0}, {result_key::kPivotXy, 0}}}},
                              {"Y", mm, {{{result_key::kPivotYz, 0}, {result_key::kPivotXy, 1}}}},
                              {"Z", mm, {{{result_key::kPivotXz, 1}, {result_key::kPivotYz, 1}}}},
                              {"lean along X", rad, {{{result_key::kLeanXz, 0}, {result_key::kLeanXy, 0}}}},
                              {"lean along Y", rad, {{{result_key::kLeanYz, 0}, {result_key::kLeanXy, 1}}}},
                              {"lean along Z", rad, {{{result_key::kLeanXz, 1}, {result_key::kLeanYz, 1}}}},
                              {"place along its axis", mm, {{{result_key::kAlong, 0}}}}};
// Of a lathe of X and Z the Y is 0.
constexpr BlockValue kSetter[]{{"X", mm, {{{result_key::kSetter, 0}, {result_key::kSetterX, 0}}}},
                               {"Y", mm, {{{result_key::kSetter, 1}}}},
                               {"Z", mm, {{{result_key::kSetter, 2}, {result_key::kSetterZ, 0}}}},
                               {"X from the turning axis", mm, {{{result_key::kLink, 0}, {result_key::kLinkX, 0}}}},
                               {"Y from the turning axis", mm, {{{result_key::kLink, 1}}}}};
constexpr BlockValue kCheck[]{{"verdict", number, {{{result_key::kVerdict, 0}}}},
                              {"worst ratio", number, {{{result_key::kWorstRatio, 0}}}}};
constexpr BlockValue kLocation[]{
    {"location X", mm, {{{result_key::kLocation, 0}}}}, {"location Y", mm, {{{result_key::kLocation, 1}}}},
    {"location Z", mm, {{{result_key::kLocation, 2}}}}, {"tilt about X", rad, {{{result_key::kTilt, 0}}}},
    {"tilt about Y", rad, {{{result_key::kTilt, 1}}}},  {"tilt about Z", rad, {{{result_key::kTilt, 2}}}}};
constexpr BlockValue kGain[]{{"gain", number, {{{result_key::kScrewGain, 0}}}}};

// The weights of preTravelParts().
constexpr BlockValue kPreTravel[]{{"across", mm, {{{result_key::kPreTravel, 0}}}},
                                  {"cos 3 phi", mm, {{{result_key::kPreTravel, 1}}}},
                                  {"sin 3 phi", mm, {{{result_key::kPreTravel, 2}}}},
                                  {"along", mm, {{{result_key::kPreTravel, 3}}}}};

constexpr BlockValue kColdReading[]{{"reading", um, {{{result_key::kColdReading, 0}}}}};

constexpr std::string_view kLocationMeans =
    "of the axis against the nominal one, across it; 0 where its angles do not tell it";
constexpr std::string_view kPivotMeans =
    "two of the three coordinates, those that its state register names; published, never summed";

constexpr ResultBlock kBlocks[]{
    {"centreline-stylus", 180, "turning axis from the tip", kFromTip,
     "turning axis C from the stylus' tip at A = 0; no centreline until an offset of the same stylus is in force",
     false},
    {"centreline-2", 360, "second turning axis", kAxis,
     "turning axis of the second chuck at its reference Z, as the main one's from register 160 on; published, never "
     "summed",
     false},
    {"centreline-stylus-2", 384, "second turning axis from the tip", kFromTip, "as register 180, of the second chuck",
     false},
    {"spindle-offset", 400, "spindle offset", kOffset, "turning axis C less spindle axis A"},
    {"spindle-tilt", 416, "spindle tilt", kSpindleTilt, "of the spindle axis A"},
    {"head-pivot", 432, "head pivot", kPivot, kPivotMeans},
    {"table-pivot", 480, "table pivot", kPivot, kPivotMeans},
    {"setter", 528, "setter", kSetter, "place of the tool-setting device"},
    {"check", 568, "check", kCheck,
     "the worst of all that has a limit: 0 pass, 1 not proven (the limit lies within U, or U is unknown), 2 fail; no "
     "verdict without "
     "bit 4 "
     "of its state"},
    {"rotary-a", 592, "A table axis", kLocation, kLocationMeans},
    {"rotary-b", 640, "B table axis", kLocation, kLocationMeans},
    {"rotary-c", 688, "C table axis", kLocation, kLocationMeans},
    {"screw-x", 736, "X screw", kGain, "of the face table's result (D2); machine.toml's where the result has none"},
    {"screw-y", 744, "Y screw", kGain, "as X"},
    {"screw-z", 752, "Z screw", kGain, "as X"},
    {"screw-reference-x", 768, "X cold screw", kColdReading,
     "um, measured reading of the sensor (D1a); the one in use, measured or not, is register 760"},
    {"screw-reference-y", 776, "Y cold screw", kColdReading, "as X"},
    {"screw-reference-z", 784, "Z cold screw", kColdReading, "as X"},
    {"pre-travel", 944, "pre-travel", kPreTravel,
     "of a touch-trigger probe, for cycles of the control: a touch along the unit normal n, in the probe's own axes, "
     "is p "
     "deep when the switch opens: p = h (p0 + p1 cos 3 phi + p2 sin 3 phi) + p3 abs(nz) of these four in turn, "
     "h = sqrt(nx^2 + ny^2), phi = atan2(ny, nx)"},
    {.subject = "check",
     .first = 980,
     .title = "proposed check",
     .values = kCheck,
     .meaning = "as register 568, of the newest check while nobody has accepted it: register 568 keeps that of the one "
                "in force",
     .is_proposed = true},
};

constexpr BlockValue kTool[]{{"X offset", mm, {{{result_key::kToolOffset, 0}, {result_key::kToolOffsetX, 0}}}},
                             {"Y offset", mm, {{{result_key::kToolOffset, 1}}}},
                             {"Z offset", mm, {{{result_key::kToolOffset, 2}, {result_key::kToolOffsetZ, 0}}}}};
constexpr BlockValue kAssembly[]{{"L4", mm, {{{result_key::kCompensation, 2}}}},
                                 {"W2 along X", mm, {{{result_key::kCompensation, 0}}}},
                                 {"W2 along Y", mm, {{{result_key::kCompensation, 1}}}}};
constexpr BlockValue kAssemblyLengths[]{{"L3", mm, {{{result_key::kAssembledLength, 0}}}},
                                        {"gauge length", mm, {{{result_key::kGaugeLength, 0}}}}};
constexpr BlockValue kStylus[]{{"X offset", mm, {{{result_key::kStylusOffset, 0}, {result_key::kStylusOffsetX, 0}}}},
                               {"Y offset", mm, {{{result_key::kStylusOffset, 1}, {result_key::kStylusOffsetY, 0}}}}};

constexpr ToolTable kTables[]{
    {"tool-", 1000, "tool", kTool, "tip of the tool from the head's reference, by tool-setter (B = 0)"},
    {"assembly-", 3000, "assembly", kAssembly,
     "for motion control: L4 to add to the length in store, W2 to the commanded position of the tip, which is at -W2 "
     "from the spindle axis"},
    {"stylus-offset-", 5000, "stylus", kStylus, "tip of the probe's stylus from the spindle axis at A = 0"},
    {"assembly-", 7000, "assembly for simulation", kAssemblyLengths,
     "L3, from the holder's face to the tip; W1 is W2 of the table of assemblies: the tip stands at -W1 from the "
     "spindle axis. The gauge length is L1 + L3, from the gauge line"},
};

}  // namespace

std::span<const ResultBlock> resultBlocks() {
  return kBlocks;
}

std::span<const ToolTable> toolTables() {
  return kTables;
}

}  // namespace probebox::modbus
