#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Where along a screw its heat is, by the strokes of its nut (docs/metrology.md (D8)): each segment of the screw is
// heated in proportion to the way that the nut makes there, and cools with two time constants. The sensor at the end
// tells how much the whole screw stretches, the strokes tell where.

// Heat of a segment: the mean way per time of the last `time_constant_s[0]`, and `ratio` times that of the second.
struct HeatLaw {
  std::array<double, 2> time_constant_s{};
  double ratio{};
};

namespace quantity {

inline constexpr Quantity kEvenGain{.key = "even_gain", .about = "part of the gain by the lever alone", .most = 10};
inline constexpr Quantity kTravelGain{
    .key = "travel_gain", .about = "part of the gain by where the nut's strokes warm the screw (D8)", .most = 10};
inline constexpr Quantity kTimeConstants{
    .key = "time_constants_s", .about = "fast and slow cooling of a segment of the screw", .most = 1e5};
inline constexpr Quantity kTimeConstantRatio{.key = "slow_heat_ratio",
                                             .about = "slow part of the heat over the fast one"};
inline constexpr Quantity kTravelRms{.key = "gain_by_travel_rms_um",
                                     .about = "what both gains leave of the true errors"};

}  // namespace quantity

// Table of where the nut was: time_s, x_mm.
inline constexpr MethodColumn kTravelColumns[]{column::kReadAt, column::kSetX};
inline constexpr const char* kTravel = "travel";

// Strokes of a nut over time, in equal segments of its screw.
class TravelHeat {
 public:
  static constexpr std::size_t kSegments = 10;

  // times_s: rising.
  TravelHeat(const ScrewModel& screw, const std::vector<double>& times_s, const std::vector<double>& positions_mm);

  // Refuses rows that were read before the first or after the last time of the strokes: outside-travel.
  std::optional<Refusal> validateTimes(const Table& table) const;

  // Mean way per time in each segment, weighted by exp(-age / time constant), at each of these times.
  using Heat = std::vector<std::array<double, kSegments>>;
  Heat smoothed(double time_constant_s, const std::vector<double>& at_s) const;
  // Share of the extension that lies between the fixed bearing and the nut, signed as leverOf, at each of these
  // positions: the lever where nothing is warm.
  std::vector<double> sharesOf(Heat fast, const Heat& slow, double ratio,
                               const std::vector<double>& positions_mm) const;
  std::vector<double> sharesOf(const HeatLaw& law, const std::vector<double>& at_s,
                               const std::vector<double>& positions_mm) const;

 private:
  double shareOf(const std::array<double, kSegments>& heat, double position_mm) const;

  ScrewModel screw_;
  std::vector<double> times_s_;
  std::vector<std::array<double, kSegments>> rate_;  // mm/s in each segment, from each time to the next
};

// Reads table `travel` of a screw; nothing without one. Refuses: what checkedTable and refuseOutside refuse,
// time-not-rising.
Outcome<std::optional<TravelHeat>, Refusal> travelOf(const Dataset& dataset, const ScrewModel& screw);

// E = (K_even lever + K_travel share) ext.
struct TravelGain {
  double even{}, travel{};
  double sd_even{}, sd_travel{};  // by what the true errors scatter about both
  HeatLaw law;
  double sum_of_squares{};  // um^2
};

// The law and gains that explain true errors best, where by likelihood they do so better than one gain, whose sum of
// squares is given: by a Bayesian information criterion that is lower by 6 (strong evidence, Kass and Raftery 1995).
// Nothing for fewer than ten readings.
std::optional<TravelGain> gainByTravel(const ScrewModel& screw, const TravelHeat& heat, const std::vector<double>& at_s,
                                       const std::vector<double>& positions_mm,
                                       const std::vector<double>& extensions_um, const std::vector<double>& errors_um,
                                       double squares_of_one);

}  // namespace probebox::metrology
