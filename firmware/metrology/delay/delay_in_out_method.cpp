#include "firmware/metrology/delay/delay_in_out.hpp"
#include "firmware/metrology/delay/delay_method.hpp"

namespace probebox::metrology {
namespace {

constexpr MethodTable kInOutTables[]{
    of_delay::kMachine,
    of_delay::kProbe,
    {"probe", of_delay::kTouchDistanceColumns, "instead, with probe_kind distance: distance from the surface"},
    of_delay::kTouches};
constexpr MethodKey kInOutKeys[]{of_delay::kPreviousTau, of_delay::kFeature, of_delay::kProbeKind, kProbeAForTheRecord,
                                 kProbeBForTheRecord};
constexpr Quantity kInOutResults[]{quantity::kTau};
constexpr std::string_view kInOutUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps,
    "the delay of an axis across the direction of motion, and the position of the surface"};

}  // namespace

const Method kDelayInOut{.name = "delay-in-out",
                         .title = "System delay from one drive in and out",
                         .equations = "(A1), (A17)-(A19)",
                         .source = source::kDelay,
                         .solver = solveDelayInOut,
                         .tables = kInOutTables,
                         .keys = kInOutKeys,
                         .results = kInOutResults,
                         .unobservable = kInOutUnobservable,
                         .subject = of_delay::kSubject};

}  // namespace probebox::metrology
