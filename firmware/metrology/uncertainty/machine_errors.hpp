#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"

// What the machine's own errors (MachineAccuracy) move the readings of a case by, as inputs of its uncertainty.
namespace probebox::metrology {

// Places that were read: each coordinate by the scale of its axis times its distance from the middle of all of them,
// and by that of each half of it; x by the squareness times y and times z, y times z; all in their order by a drift
// that slows down; z by half of the lost motion, because a ball is touched from above alone. Touches with their
// normals, and single contacts: either side by half of the lost motion. Streams: an axis that moves by half of the lost
// motion, against its motion; those of joints as if the lost motion that is known, and the size, were off. One input
// for each axis or pair of axes; none of an error that is stated as 0, or that the method itself measures. Keys that
// the case does not state have the cautious values. Refuses: bad-config (below zero, too large).
Outcome<std::vector<TypeBInput>, Refusal> machineErrors(const Dataset& dataset, const Method& method);

// The same for touches whose streams were read, of Result::touched, as inputs that move those outwards: scale,
// squareness, drift, and the form of probing, which is another one in each direction. Lost motion is in machineErrors.
std::vector<TypeBInput> touchErrors(const Dataset& dataset, const Method& method, const Table& touched);

// Names of inputs of suspectedErrors beside those of kMachineErrors.
inline constexpr std::string_view kLobing = "lobing", kCurvature = "curvature", kErrorMotion = "error_motion";

// The same errors, each of its cautious size whatever the case states, of the places along streams too: what may have
// left the residuals of a case. Also three lobes of the probe at single contacts, a gain that bends by 1 %, and a C
// that runs out twice a turn.
std::vector<TypeBInput> suspectedErrors(const Dataset& dataset, const Method& method);

// Number of places that were read, one after the other: a drift moves each by its time.
std::size_t placesRead(const Dataset& dataset, const Method& method);

// Sentence about the errors of these names, of which the case states no value; nothing of none.
std::optional<std::string> assumedAccuracy(const std::vector<std::string>& names);

}  // namespace probebox::metrology
