#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {

inline constexpr std::size_t kMostAngles = 72;

// An angle, rad, with its sine and cosine, for what needs them more than once.
struct AngleWithSine {
  explicit AngleWithSine(double angle) : rad{angle}, sine{std::sin(angle)}, cosine{std::cos(angle)} {}

  double rad, sine, cosine;
};

// Interpolation between the angles of a table: linear, or by the harmonics that its angles determine.
enum class Between { linear, fourier };

// Interpolates the errors of a rotary axis between measured angles ((E8) in docs/metrology.md). Never allocates.
// kWidth: number of errors at each angle.
template <int kWidth>
class AngleTable {
 public:
  using Row = Eigen::Matrix<double, kWidth, 1>;

  // angles: rad, in any order; rows: the errors there. Whole turns are ignored. Refuses: too-few-readings (2),
  // too-many-angles (72), not-finite, duplicated-angle, and for fourier uneven-angles: it needs 3 or more over the
  // whole turn, equally spaced.
  static Outcome<AngleTable, Refusal> make(std::span<const double> angles, std::span<const Row> rows, Between between);

  // Errors at any angle, rad. Nothing for an angle that is not finite or lies in a gap of the table wider than 100
  // degrees: nothing is extrapolated over so wide a gap.
  std::optional<Row> at(double angle) const {
    return between_ == Between::fourier ? harmonics(AngleWithSine{angle}) : chord(angle);
  }
  std::optional<Row> at(const AngleWithSine& angle) const {
    return between_ == Between::fourier ? harmonics(angle) : chord(angle.rad);
  }

 private:
  static constexpr std::size_t kSlotsAtOnce = 4;
  static constexpr double kWidestGap = kTurn * 100.0 / 360.0;

  static double withinTurn(double angle) {
    const double within = angle - kTurn * std::floor(angle / kTurn);
    return within < kTurn - kSameTableAngle_rad ? within : 0.0;
  }
  // Place of the first angle beyond one, count_ where there is none.
  std::size_t firstAbove(double within) const {
    // Right where the angles are evenly spaced from zero.
    const auto guess = static_cast<std::size_t>(within * (static_cast<double>(count_) / kTurn)) + 1;
    if (guess < count_ && angles_[guess - 1] <= within && within < angles_[guess]) return guess;
    const auto end = angles_.begin() + static_cast<std::ptrdiff_t>(count_);
    return static_cast<std::size_t>(std::upper_bound(angles_.begin(), end, within) - angles_.begin());
  }
  static std::optional<Refusal> bad(std::span<const double> angles, std::span<const Row> rows);
  void transform();
  std::optional<Row> chord(double angle) const;
  std::optional<Row> harmonics(const AngleWithSine& angle) const;

  Between between_{Between::linear};
  std::size_t count_{};
  std::array<double, kMostAngles> angles_{};  // rising, within a turn
  AngleWithSine first_{0.0};                  // angles_[0], from which harmonics count
  // Values there; for fourier mean, then cosine and sine of each harmonic, and zeros behind the last.
  std::array<Row, kMostAngles + kSlotsAtOnce - 1> rows_{};
};

template <int kWidth>
std::optional<Refusal> AngleTable<kWidth>::bad(std::span<const double> angles, std::span<const Row> rows) {
  if (angles.size() < 2 || angles.size() != rows.size()) {
    return Refusal{"too-few-readings", "a table by angle needs two angles or more, with their errors"};
  }
  if (angles.size() > kMostAngles) {
    return Refusal{"too-many-angles", "a table by angle holds up to 72 angles: omit some"};
  }
  for (std::size_t k = 0; k < angles.size(); ++k) {
    if (!std::isfinite(angles[k]) || !rows[k].allFinite()) {
      return Refusal{"not-finite",
                     "row " + std::to_string(k + 1) +
                         " of the table by angle is not a finite number: measure that angle again, or omit it"};
    }
  }
  return std::nullopt;
}

template <int kWidth>
Outcome<AngleTable<kWidth>, Refusal> AngleTable<kWidth>::make(std::span<const double> angles, std::span<const Row> rows,
                                                              Between between) {
  if (auto refusal = bad(angles, rows)) return *refusal;
  std::array<std::size_t, kMostAngles> all{};
  const std::span order{all.data(), angles.size()};
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::ranges::sort(order, {}, [&](std::size_t k) { return withinTurn(angles[k]); });
  AngleTable table;
  table.between_ = between;
  table.count_ = order.size();
  for (std::size_t k = 0; k < order.size(); ++k) {
    table.angles_[k] = withinTurn(angles[order[k]]);
    table.rows_[k] = rows[order[k]];
    if (k > 0 && table.angles_[k] - table.angles_[k - 1] < kSameTableAngle_rad) {
      return Refusal{"duplicated-angle", "the table by angle has one angle twice: give every angle once"};
    }
  }
  if (between == Between::linear) return table;
  if (!areEvenOverTurn(std::span{table.angles_}.first(table.count_))) {
    return Refusal{"uneven-angles",
                   "harmonics need three or more angles, equally spaced over the whole turn: use linear interpolation"};
  }
  table.transform();
  return table;
}

// rows_: mean, then the cosine and the sine of each harmonic, as many as there are angles.
template <int kWidth>
void AngleTable<kWidth>::transform() {
  const auto values = rows_;
  const auto n = static_cast<double>(count_);
  std::fill_n(rows_.begin() + static_cast<std::ptrdiff_t>(count_), kSlotsAtOnce - 1, Row::Zero());
  first_ = AngleWithSine{angles_[0]};
  for (std::size_t slot = 0; slot < count_; ++slot) {
    const double harmonic = static_cast<double>((slot + 1) / 2);
    const bool cosine = slot % 2 == 1;
    // With an even number of angles the highest harmonic has a cosine only, with full weight.
    const double weight = slot == 0 || 2.0 * harmonic == n ? 1.0 / n : 2.0 / n;
    rows_[slot].setZero();
    for (std::size_t k = 0; k < count_; ++k) {
      const double turned = harmonic * (angles_[k] - angles_[0]);
      rows_[slot] += weight * (slot == 0 || cosine ? std::cos(turned) : std::sin(turned)) * values[k];
    }
  }
}

template <int kWidth>
auto AngleTable<kWidth>::chord(double angle) const -> std::optional<Row> {
  if (!std::isfinite(angle)) return std::nullopt;
  const double within = withinTurn(angle);
  const std::size_t above = firstAbove(within);
  const std::size_t left = (above + count_ - 1) % count_;
  const std::size_t right = above % count_;
  double gap = angles_[right] - angles_[left];
  if (right <= left) gap += kTurn;
  double from = within - angles_[left];
  if (from < 0.0) from += kTurn;
  // Rounding of an angle must not put it beyond the end of the table.
  if (from < kSameTableAngle_rad) return rows_[left];
  if (gap - from < kSameTableAngle_rad) return rows_[right];
  if (gap > kWidestGap) return std::nullopt;
  return Row{rows_[left] + (from / gap) * (rows_[right] - rows_[left])};
}

template <int kWidth>
auto AngleTable<kWidth>::harmonics(const AngleWithSine& angle) const -> std::optional<Row> {
  if (!std::isfinite(angle.rad)) return std::nullopt;
  const double cosine = angle.cosine * first_.cosine + angle.sine * first_.sine;
  const double sine = angle.sine * first_.cosine - angle.cosine * first_.sine;
  const double cosine_of_two = cosine * cosine - sine * sine, sine_of_two = 2.0 * sine * cosine;
  const auto goTwoUp = [&](double& c, double& s) {
    const double next = c * cosine_of_two - s * sine_of_two;
    s = s * cosine_of_two + c * sine_of_two;
    c = next;
  };
  // Odd and even harmonics side by side: no product waits for the one before it.
  double odd_c = cosine, odd_s = sine, even_c = cosine_of_two, even_s = sine_of_two;
  Row cosines = rows_[0], sines = Row::Zero();
  for (std::size_t slot = 1; slot < count_; slot += kSlotsAtOnce) {
    cosines += odd_c * rows_[slot];
    sines += odd_s * rows_[slot + 1];
    cosines += even_c * rows_[slot + 2];
    sines += even_s * rows_[slot + 3];
    goTwoUp(odd_c, odd_s);
    goTwoUp(even_c, even_s);
  }
  return Row{cosines + sines};
}

}  // namespace probebox::metrology
