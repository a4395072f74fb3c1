#include "tools/probebox/tables/tip_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware/latch/record.hpp"
#include "protocol/codec/block.hpp"

namespace probebox::command {
namespace {

using Three = std::array<double, 3>;

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
constexpr Three kNone{kNotKnown, kNotKnown, kNotKnown};
constexpr std::array<std::string_view, 7> kChannels{"deflection_a", "deflection_b", "deflection_c", "position_x",
                                                    "position_y",   "position_z",   "flags"};
constexpr double kMillimetresPerNanometre = 1e-6;

// Directions are taken from the motion within this time to either side.
constexpr double kReach_s = 0.004;
constexpr std::size_t kKept = 16;  // bodies of the block before

// Less deflection than this is no contact, or tells no direction: 20 standard deviations of a channel, at least 20 um.
constexpr double kContact_mm = 0.02;
constexpr double kContactInSd = 20;
// A tip that moved by less than this many standard deviations rests.
constexpr double kMovedInSd = 20;
// Limit of the drag beyond what friction explains, in sd.
constexpr double kDragInSd = 5;
// Positions within this time of each other may share a reading of a slow encoder.
constexpr double kScatterLag_s = 0.002;
constexpr std::size_t kFewestDifferences = 8;
constexpr double kSdPerMedian = 1.4826;  // of a normal distribution's absolute values
// As the descriptor follows a screw.
constexpr double kScrewSd_mm = 0.0002;

double dot(const Three& a, const Three& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double norm(const Three& a) {
  return std::sqrt(dot(a, a));
}
Three plus(const Three& a, double factor, const Three& b) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

std::string axesOf(unsigned mask) {
  std::string names;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if ((mask >> axis & 1U) != 0) names += (names.empty() ? "" : ", ") + std::string{"XYZ"[axis]};
  }
  return names;
}

}  // namespace

std::array<double, kPointColumns.size()> valuesOf(const TipPoint& point) {
  std::array<double, kPointColumns.size()> values{};
  auto next = values.begin();
  for (const auto* three : {&point.tip_mm, &point.sd_tip_mm, &point.normal, &point.surface_mm, &point.sd_surface_mm})
    next = std::ranges::copy(*three, next).out;
  *next = point.sd_along_normal_mm;
  return values;
}

std::optional<std::string> whyNoTip(const messages::Descriptor& descriptor) {
  const auto& tip = descriptor.tip;
  if (!tip.has_deflection && tip.ball_radius_mm == 0 && tip.noise_nm == 0)
    return "the recording does not say how samples become positions of the tip: record them from a box (pack makes "
           "none)";
  if (!tip.has_deflection)
    return "the channels are no deflections of a stylus (a touch-trigger probe, or a sensor head in the spindle)";
  for (std::size_t i = 0; i + 1 < kChannels.size(); ++i) {
    if (std::ranges::find(descriptor.channels, kChannels[i], &messages::ChannelDescription::name) ==
        descriptor.channels.end())
      return "the recording has no channel " + std::string{kChannels[i]};
  }
  if (tip.referenced != 7)
    return "the machine position of " + axesOf(~unsigned{tip.referenced} & 7U) +
           " is not known: home it (probebox home), or move it over its reference mark";
  if (tip.screws_unknown != 0)
    return "the sensor on the screw of " + axesOf(tip.screws_unknown) +
           " delivers no readings, so what the warm screw adds is not known: probebox corrections shows why";
  if (tip.turned)
    return "the probe was turned (spindle A or the swivelling head), and its gain is that of the probe at zero";
  if (!descriptor.delay.calibrated)
    return "no system delay is in force: deflections and positions do not belong together; calibrate it (probebox "
           "calibrate delay-known-sphere)";
  return std::nullopt;
}

std::optional<std::string> whyNoSd(const messages::Descriptor& descriptor) {
  if (descriptor.tip.gain_result_id == 0)
    return "the gain is that of probe.toml, and nobody says how well it is known: calibrate it (probebox calibrate "
           "delay-known-sphere)";
  if (descriptor.tip.noise_nm <= 0) return "probe.toml states no noise of the probe: give [probe] noise_um";
  return std::nullopt;
}

void TipPoints::lack(std::string_view what, const std::string& why, std::int64_t sample) {
  auto& missing = missing_.try_emplace(why, Missing{what, sample, 0}).first->second;
  ++missing.samples;
}

const TipPoint& TipPoints::of(const link::DecodedBlock& block, std::size_t k) {
  if (taken_ != codec::timeOf(block.header, block.header.first) || points_.size() != block.header.count) take(block);
  return points_[k];
}

void TipPoints::take(const link::DecodedBlock& block) {
  const std::size_t count = block.header.count;
  taken_ = codec::timeOf(block.header, block.header.first);
  points_.assign(count, TipPoint{kNone, kNone, kNone, kNone, kNone, kNotKnown});
  if (const auto why = whyNoTip(block.descriptor)) {
    for (std::size_t k = 0; k < count; ++k) lack("tip", *why, block.header.first.index + static_cast<std::int64_t>(k));
    bodies_.clear();
    return;
  }
  computeBodies(block);
  for (std::size_t k = 0; k < count; ++k) compute(block.descriptor, k);
}

// Keeps the end of the block before where this one follows it without a gap.
void TipPoints::computeBodies(const link::DecodedBlock& block) {
  const auto& tip = block.descriptor.tip;
  const auto& channels = block.descriptor.channels;
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    const auto found = std::ranges::find(channels, kChannels[i], &messages::ChannelDescription::name);
    columns_[i] = static_cast<std::size_t>(found - channels.begin());
  }
  const bool follows = !bodies_.empty() && bodies_.back().sample + 1 == block.header.first.index;
  const std::size_t kept = follows ? std::min(kKept, bodies_.size()) : 0;
  bodies_.erase(bodies_.begin(), bodies_.end() - static_cast<std::ptrdiff_t>(kept));
  first_ = kept;
  for (std::size_t k = 0; k < block.header.count; ++k) {
    const SampleIndex sample = block.header.first + static_cast<std::int64_t>(k);
    Body body{.sample = sample.index, .time_s = 1e-9 * static_cast<double>(toNs(codec::timeOf(block.header, sample)))};
    const auto value = [&](std::size_t i) {
      return static_cast<double>(block.column(columns_[i])[k]) * channels[columns_[i]].scale;
    };
    for (std::size_t i = 0; i < 3; ++i) body.channels_mm[i] = value(i) * kMillimetresPerNanometre;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double machine_mm = value(3 + axis) + tip.offset_mm[axis];
      body.mm[axis] = machine_mm - (tip.screw_mm[axis] + tip.screw_slope[axis] * machine_mm);
      body.pushed_mm[axis] = dot(block.descriptor.gain[axis], body.channels_mm);
    }
    if (columns_[6] < channels.size()) body.clipped = (block.column(columns_[6])[k] & latch::flag::kClipped) != 0;
    bodies_.push_back(body);
  }
  measureScatter();
}

// Third differences have no part of a speed or an acceleration; their median none of what is rare. A block that is too
// short keeps the scatter of the one before.
void TipPoints::measureScatter() {
  const auto later = std::ranges::find_if(
      bodies_, [&](const Body& body) { return body.time_s - bodies_.front().time_s >= kScatterLag_s; });
  const auto lag = static_cast<std::size_t>(later - bodies_.begin());
  if (bodies_.size() < 3 * lag + kFewestDifferences) return;
  std::vector<double> misses(bodies_.size() - 3 * lag);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < misses.size(); ++k) {
      const auto at = [&](std::size_t lags) { return bodies_[k + lags * lag].mm[axis]; };
      misses[k] = std::abs(at(3) - 3 * at(2) + 3 * at(1) - at(0));
    }
    const auto middle = misses.begin() + static_cast<std::ptrdiff_t>(misses.size() / 2);
    std::ranges::nth_element(misses, middle);
    scatter_mm_[axis] = *middle * kSdPerMedian / std::sqrt(1 + 9 + 9 + 1);
  }
}

// Rows within kReach_s to either side.
TipPoints::Reach TipPoints::reachOf(std::size_t k) const {
  const std::size_t at = first_ + k;
  Reach reach{at, at};
  while (reach.from > 0 && bodies_[at].time_s - bodies_[reach.from - 1].time_s <= kReach_s) --reach.from;
  while (reach.to + 1 < bodies_.size() && bodies_[reach.to + 1].time_s - bodies_[at].time_s <= kReach_s) ++reach.to;
  return reach;
}

Three TipPoints::wayOf(Reach reach, bool of_tip) const {
  const auto placeOf = [&](const Body& body) { return of_tip ? plus(body.mm, 1, body.pushed_mm) : body.mm; };
  return plus(placeOf(bodies_[reach.to]), -1, placeOf(bodies_[reach.from]));
}

void TipPoints::compute(const messages::Descriptor& descriptor, std::size_t k) {
  const Body& body = bodies_[first_ + k];
  TipPoint& point = points_[k];
  if (body.clipped) return lack("tip", "the probe stood at the end of its range", body.sample);
  point.tip_mm = plus(body.mm, 1, body.pushed_mm);
  ++tips_;
  const Reach reach = reachOf(k);
  const double seconds = secondsOf(reach);
  const Three way_mm = wayOf(reach, false);
  const double noise_mm = descriptor.tip.noise_nm * kMillimetresPerNanometre;
  auto why = whyNoSd(descriptor);
  if (!why && seconds <= 0) why = "a single sample has no speed, so the effect of the delay's uncertainty is unknown";
  if (why) lack("sd", *why, body.sample);
  Three pushed_variance{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double gain = descriptor.gain[axis][i], sd_gain = descriptor.tip.gain_sd[axis][i];
      const double channel_mm = body.channels_mm[i];
      pushed_variance[axis] += gain * gain * noise_mm * noise_mm + sd_gain * sd_gain * channel_mm * channel_mm;
    }
    if (why) continue;
    const double late_mm = way_mm[axis] / seconds * descriptor.delay.sd_s[axis];
    // A scatter of less than a count is that of rounding.
    const double read_mm = std::max(scatter_mm_[axis], descriptor.channels[columns_[3 + axis]].scale / std::sqrt(12.0));
    const double screw_mm = (unsigned{descriptor.tip.screws} >> axis & 1U) != 0 ? kScrewSd_mm : 0;
    point.sd_tip_mm[axis] =
        std::sqrt(pushed_variance[axis] + late_mm * late_mm + read_mm * read_mm + screw_mm * screw_mm);
  }
  addSurface(descriptor, k, pushed_variance);
}

void TipPoints::addSurface(const messages::Descriptor& descriptor, std::size_t k, const Three& pushed_variance) {
  const Body& body = bodies_[first_ + k];
  TipPoint& point = points_[k];
  const double radius_mm = descriptor.tip.ball_radius_mm;
  const double noise_mm = descriptor.tip.noise_nm * kMillimetresPerNanometre;
  const double contact_mm = std::max(kContact_mm, kContactInSd * noise_mm);
  if (norm(body.pushed_mm) < contact_mm) return;  // in the air
  if (radius_mm <= 0) return lack("surface", "the radius of the stylus' ball is not described", body.sample);
  const Reach reach = reachOf(k);
  const auto touches = [&](const Body& near) { return norm(near.pushed_mm) >= contact_mm; };
  if (!std::all_of(bodies_.begin() + static_cast<std::ptrdiff_t>(reach.from),
                   bodies_.begin() + static_cast<std::ptrdiff_t>(reach.to) + 1, touches))
    return lack("surface", "the ball met the surface or left it within 4 ms", body.sample);
  const Three way_mm = wayOf(reach, true);
  const double moved_mm = norm(way_mm);
  const double way_sd_mm = std::sqrt(2.0) * std::hypot(noise_mm, *std::ranges::max_element(scatter_mm_));
  const bool slides = moved_mm > std::max(kMovedInSd * way_sd_mm, 1e-3);
  Three across = body.pushed_mm;
  const double drag_mm = slides ? dot(across, way_mm) / moved_mm : 0;
  // Friction acts along the motion alone: what is across it comes from the surface.
  if (slides) across = plus(across, -drag_mm / moved_mm, way_mm);
  const double across_mm = norm(across);
  // By how well the motion's direction is known, or by friction.
  const double along = slides ? way_sd_mm / moved_mm : friction_ / 2;
  if (slides && std::abs(drag_mm) > friction_ * across_mm + kDragInSd * std::hypot(noise_mm, along * across_mm))
    return lack(
        "surface",
        "the stylus was dragged by more than friction can: it bounced, or --friction is too small for this part",
        body.sample);
  point.normal = plus({}, 1 / across_mm, across);
  point.surface_mm = plus(point.tip_mm, -radius_mm, point.normal);
  ++surfaces_;
  if (point.sd_tip_mm[0] != point.sd_tip_mm[0]) return;
  // Along the normal its own error counts in second order.
  const double pushed_turned = *std::ranges::max_element(pushed_variance) / (across_mm * across_mm);
  const double sunk_mm = radius_mm * (pushed_turned + along * along);
  double variance = sunk_mm * sunk_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double n = point.normal[axis], tip_mm = point.sd_tip_mm[axis];
    const double turned = (1 - n * n) * (pushed_variance[axis] / (across_mm * across_mm) + along * along);
    point.sd_surface_mm[axis] = std::sqrt(tip_mm * tip_mm + radius_mm * radius_mm * turned + n * n * sunk_mm * sunk_mm);
    variance += n * n * tip_mm * tip_mm;
  }
  point.sd_along_normal_mm = std::sqrt(variance);
}

}  // namespace probebox::command
