#pragma once
#include <array>
#include <string_view>

#include "firmware/metrology/dataset/method.hpp"

// Parts that the descriptors of several methods share: sources, keys, known quantities.
namespace probebox::metrology {

namespace source {
inline constexpr std::string_view kDelay = "CN101622513 (system delay)";
inline constexpr std::string_view kMachine = "CN101976057 (machine tool calibration)";
inline constexpr std::string_view kTool = "CN103801980 (tool assemblies)";
inline constexpr std::string_view kScrew = "CN101394969 (ball screws)";
inline constexpr std::string_view kRotary = "CN112247668 (rotary axes)";
}  // namespace source

namespace key {
inline constexpr MethodKey kSigma{"sigma_mm", "",
                                  "standard deviation of one reading (k = 1); without it, from residuals"};
inline constexpr MethodKey kSigmaC =
    MethodKey{"sigma_C_rad", "", "standard deviation of an angle of C (k = 1)"}.upTo(quantity::kMostLean_rad);
inline constexpr MethodKey kSigmaAngle =
    MethodKey{"sigma_angle_rad", "0", "standard deviation of a stop of the axis (k = 1)"}.upTo(quantity::kMostLean_rad);
inline constexpr MethodKey kASense{"A_sense", "1", "-1 where A of the spindle is left-handed about +Z"};
inline constexpr MethodKey kCSense{"C_sense", "1", "-1 where C is left-handed about +Z"};
inline constexpr MethodKey kSpindle{"spindle", "1", "1 the main chuck, 2 the second one, whose results are its own"};
inline constexpr MethodKey kMeanHeight{
    "mean_z_mm", "", "mean height at which the ball was read: centre_mm of a tilted axis holds at this height"};
inline constexpr MethodKey kTauForTheRecord =
    MethodKey{"previous_tau_axis_s", "", "delays of the axes already subtracted from the positions; for the record"}
        .upTo(quantity::kMostDelay_s);
inline constexpr MethodKey kMachineAxes{"machine_axes", "XYZ",
                                        "XZ: touches of a lathe without Y, which tell x and z alone"};
inline constexpr std::array<std::string_view, 2> kAxesOfMachines{"XYZ", "XZ"};
inline constexpr MethodKey kStylusRadius =
    MethodKey{"stylus_ball_radius_mm", "",
              "radius of the stylus ball; if given, the size of the feature itself is answered too"}
        .within(0.01, 50);
inline constexpr MethodKey kLeastRadius{"radius_min_mm", "", "a smaller radius is refused"};
inline constexpr MethodKey kGreatestRadius{"radius_max_mm", "", "a larger radius is refused"};
inline constexpr MethodKey kRobust{"robust", "false", "true: drop outliers once instead of refusing the case"};
inline constexpr MethodKey kFeatureAxis{"feature_axis", "[0,0,1]", "axis of the feature, along X, Y or Z"};
inline constexpr MethodKey kSwivelAxis{"swivel_axis", kNeeded, "unit vector of the swivel axis, along X, Y or Z"};
// Results with the lengths of the tools that carry the probe, in the order in which the tools were read.
inline constexpr std::array<MethodKey, 4> kLengthResults{
    {{"length_1_result", "", "number of the assembly result that states the length of the first tool; for the record",
      SubjectKind::assembly},
     {"length_2_result", "", "the same for the second tool", SubjectKind::assembly},
     {"length_3_result", "", "the same for the third tool", SubjectKind::assembly},
     {"length_4_result", "", "the same for the fourth tool", SubjectKind::assembly}}};
// Results with the pre-travels of a touch-trigger probe, in the same order.
inline constexpr std::array<MethodKey, 4> kPreTravelResults{
    {{"pre_travel_1_result", "",
      "number of the pre-travel result that was subtracted for the first tool; for the record",
      SubjectKind::pre_travel},
     {"pre_travel_2_result", "", "the same for the second tool", SubjectKind::pre_travel},
     {"pre_travel_3_result", "", "the same for the third tool", SubjectKind::pre_travel},
     {"pre_travel_4_result", "", "the same for the fourth tool", SubjectKind::pre_travel}}};
}  // namespace key

inline constexpr KnownQuantity kStylusRadiusKnown[]{
    {"sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value, false, "stylus ball"}};

}  // namespace probebox::metrology
