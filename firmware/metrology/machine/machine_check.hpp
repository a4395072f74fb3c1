#pragma once
#include <iterator>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/machine/sphere_form.hpp"

namespace probebox::metrology {

// Method "machine-check": what a machine and its probe are, from touches of one sphere in many directions at two
// speeds, the first ones again in the middle and at the end (docs/metrology.md A.12). Terms are those of ISO 230-2, ISO
// 230-10 and ISO 10360-5. Tables machine, probe, touches. Config: effective_diameter_mm, if known. Refuses:
// single-speed, speeds-too-close, few-directions, not-closed (drift is not told from form), way-in-missing,
// spindle-turned, head-swivelled, and what readTouches and fitWholeRecord refuse.
Outcome<Result, Refusal> solveMachineCheck(const Dataset& dataset);

namespace quantity {

inline std::string lobeName(std::size_t component) {
  return component < std::size(kLobeNames) ? std::string{kLobeNames[component]} : std::string{};
}
inline constexpr QuantityColumn kLobeColumns[]{{"outwards", "um", 1e3}};

inline constexpr QuantityColumn kFormColumns[]{
    {"azimuth", "deg"}, {"elevation", "deg"}, {"found", "um", 1e3}, {"by the lobes", "um", 1e3}};

inline constexpr Quantity kRepeatability{
    .key = "repeatability_mm",
    .about =
        "bi-directional repeatability R of a touch along each axis, x y z (ISO 230-2, by ISO 230-10): two sd of the "
        "ways in, two of the ways out, and the lost motion",
    .kind = QuantityKind::error,
    .axes = "XYZ",
    .standard = "bi-directional repeatability R (ISO 230-2), of probing (ISO 230-10)"};
inline constexpr Quantity kForm3d{
    .key = "form_3d_mm",
    .about =
        "3-D form of probing, P_FTU (ISO 10360-5, ISO 230-10): range of the distances from the fitted sphere, one "
        "touch a direction at the slowest speed, drift taken out",
    .kind = QuantityKind::error,
    .standard = "form error of probing, P_FTU (ISO 10360-5), P_FTU,3D (ISO 230-10)",
    .measures = {&kProbingFormError, 1e3 / 3.93}};  // the range of 25 normal deviates, in their sd
inline constexpr Quantity kForm2d{
    .key = "form_2d_mm",
    .about = "2-D form of probing, P_FTU,2D (ISO 230-10): the same of the directions across the stylus, about a circle",
    .kind = QuantityKind::error,
    .standard = "form error of probing, P_FTU,2D (ISO 230-10)"};
inline constexpr Quantity kLobing{
    .key = "lobing_mm",
    .about =
        "harmonics of the form, free of noise, outwards positive, times the sine of the angle to the stylus: cosine "
        "and sine of 2, 3 and 4 lobes about it, and the part across the stylus against along it",
    .kind = QuantityKind::error,
    .part_name = lobeName,
    .title = "lobing",
    .rows = kLobeNames,
    .columns = kLobeColumns};
inline constexpr Quantity kGainCurvature{
    .key = "gain_curvature_per_mm",
    .about = "share by which each channel of the probe reads too much, per mm of deflection along it",
    .axes = "abc",
    .name = "gain curvature of channel"};
inline constexpr Quantity kDrift{
    .key = "machine_drift_um_per_min",
    .about = "mean drift of what is touched against the machine's coordinates, without the probe's, x y z",
    .axes = "XYZ",
    .measures = {&kDriftError}};
inline constexpr Quantity kZeroDrift{.key = "zero_drift_um_per_min",
                                     .about = "mean drift of the probe's zero, along the machine's x y z",
                                     .axes = "XYZ"};
inline constexpr Quantity kNoiseMachine{
    .key = "noise_machine_mm",
    .about = "sd of one position at rest, x y z; only if the machine rests in touches",
    .kind = QuantityKind::error,
    .axes = "XYZ"};
inline constexpr Quantity kNoiseProbe{.key = "noise_probe_mm",
                                      .about = "sd of one deflection without contact, along the machine's x y z",
                                      .kind = QuantityKind::error,
                                      .axes = "XYZ"};
inline constexpr Quantity kHysteresis{.key = "probe_hysteresis_mm",
                                      .about = "part of the lost motion that is alike in all directions: of the probe",
                                      .kind = QuantityKind::error};
inline constexpr Quantity kTouchScatterIn{
    .key = "touch_scatter_in_mm", .about = "sd of one way in of a touch", .kind = QuantityKind::error};
inline constexpr Quantity kTouchScatterOut{
    .key = "touch_scatter_out_mm", .about = "sd of one way out of a touch", .kind = QuantityKind::error};
inline constexpr Quantity kFormByDirection{
    .key = "form_by_direction", .about = "", .title = "map of the form by direction", .columns = kFormColumns};

// The strongest line in the noise of a signal, where one stands out: of "machine" the positions at rest, of "contact"
// the deflection then, of "free" the deflection without contact.
inline constexpr Quantity kLineMachine{.key = "line_machine_mm", .kind = QuantityKind::error};
inline constexpr Quantity kLineMachineHz{.key = "line_machine_hz"};
inline constexpr Quantity kLineContact{.key = "line_contact_mm", .kind = QuantityKind::error};
inline constexpr Quantity kLineContactHz{.key = "line_contact_hz"};
inline constexpr Quantity kLineFree{.key = "line_free_mm", .kind = QuantityKind::error};
inline constexpr Quantity kLineFreeHz{.key = "line_free_hz"};

}  // namespace quantity

extern const Method kMachineCheck;

}  // namespace probebox::metrology
