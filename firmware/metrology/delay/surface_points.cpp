#include "firmware/metrology/delay/surface_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/dwell_ringing.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kHighestThreshold = 0.8;  // of the deflection: above the machine still gathers speed
constexpr double kLeastThreshold = 5.0;    // deviations of one sample

Signal channelOf(const Stream& stream, Index channel) {
  const Eigen::VectorXd values = stream.values.col(channel);
  return {stream.times, {values.begin(), values.end()}};
}

// The machine's stream less the article's at the same stamps (cubic, never extrapolated nor across gaps).
Stream relativeTo(const Stream& article, const Stream& machine) {
  Stream relative;
  if (article.times.size() < 4) return relative;
  std::vector<Index> rows;
  const Signal first = channelOf(article, 0);
  const double allowed = kGapPeriods * first.period();
  std::size_t at = 0;
  for (std::size_t k = 0; k < machine.times.size(); ++k) {
    const double t = machine.times[k];
    while (at + 2 < article.times.size() && article.times[at + 1] <= t) ++at;
    const bool within = t >= article.times[at] && t <= article.times[at + 1];
    if (!within || article.times[at + 1] - article.times[at] > allowed) continue;
    relative.times.push_back(t);
    rows.push_back(static_cast<Index>(k));
  }
  relative.values = machine.values(rows, Eigen::all);
  for (Index channel = 0; channel < 3; ++channel) {
    const Signal signal = channelOf(article, channel);
    const Interpolant between{signal, Interpolation::cubic};
    std::size_t cursor = 0;
    for (std::size_t k = 0; k < relative.times.size(); ++k) {
      relative.values(static_cast<Index>(k), channel) -= between.at(relative.times[k], cursor).value;
    }
  }
  return relative;
}

// Velocity of the article while the machine's line holds.
Vector3d velocityOf(const Stream& article, const Line& machine) {
  const double half = std::sqrt(3.0 * machine.sxx / static_cast<double>(machine.n));
  const auto begin = std::ranges::lower_bound(article.times, machine.t_mean - half) - article.times.begin();
  const auto end = std::ranges::upper_bound(article.times, machine.t_mean + half) - article.times.begin();
  if (end - begin < 2) return Vector3d::Zero();
  const Run run{static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
  return fitLine(article.timesOf(run), article.valuesOf(run)).slope;
}

// Contribution of the article's samples to a line through positions relative to the article, for unit variance of one
// of its samples. The article is interpolated, so neighbours share its noise.
struct ArticleShare {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // of the line's middle and slope
  double scatter{};  // of a residual of the line, on average over its degrees of freedom
};

ArticleShare articleShare(const Stream& article, const Stream& relative, const Line& machine) {
  const double half = std::sqrt(3.0 * machine.sxx / static_cast<double>(machine.n));
  const Signal signal = channelOf(article, 0);
  const Interpolant between{signal, Interpolation::cubic};
  std::array<Eigen::VectorXd, 2> gains{Eigen::VectorXd::Zero(article.values.rows()),
                                       Eigen::VectorXd::Zero(article.values.rows())};
  const auto n = static_cast<double>(machine.n);
  ArticleShare share;
  std::size_t cursor = 0;
  for (const double t : relative.times) {
    const double since = t - machine.t_mean;
    if (std::abs(since) > half) continue;
    between.addGains(t, 1.0 / n, cursor, gains[0]);
    between.addGains(t, since / machine.sxx, cursor, gains[1]);
    share.scatter += between.varianceAt(t, cursor) / (n - 2.0);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      share.covariance(static_cast<Index>(i), static_cast<Index>(j)) = gains[i].dot(gains[j]);
    }
  }
  share.scatter -= (n * share.covariance(0, 0) + machine.sxx * share.covariance(1, 1)) / (n - 2.0);
  return share;
}

// Noise of one sample, from its distance to the line between its neighbours: the article need not move evenly.
SampleNoise articleNoise(const Stream& article, const Vector3d& motion) {
  Signal along{article.times, {}};
  for (const auto row : article.values.rowwise()) along.values.push_back(row.dot(motion));
  SampleNoise noise{sampleVariance(along, Interpolation::cubic), 0.0};
  for (Index channel = 0; channel < 3; ++channel) {
    noise.across += 0.5 * sampleVariance(channelOf(article, channel), Interpolation::cubic);
  }
  noise.across = std::max(noise.across - 0.5 * noise.along, 0.0);
  return noise;
}

struct Crossing {
  double time{};      // s
  double variance{};  // s^2
};

// Variance of |A d| where the deflection falls.
double bendVariance(const Retract& retract, const SampleNoise& probe, const Eigen::Matrix3d& gain) {
  const Vector3d falling = retract.probe.slope.normalized();
  const Vector3d seen = gain.transpose() * (gain * falling).normalized();
  return probe.across * seen.squaredNorm() + (probe.along - probe.across) * std::pow(falling.dot(seen), 2);
}

// The last time at which |A d| falls through the level, by a line between the samples beside it.
// probe: noise of one of its samples.
Outcome<Crossing, Refusal> crossingOf(const Touch& touch, const Retract& retract, const SampleNoise& probe,
                                      const PointQuestion& question) {
  const double level = *question.threshold_mm;
  Signal size{touch.probe.times, {}};
  for (const auto row : touch.probe.values.rowwise()) size.values.push_back((question.gain * row.transpose()).norm());
  const double sigma = std::sqrt(bendVariance(retract, probe, question.gain));
  const double deepest = (question.gain * retract.probe_apex).norm();
  // A sample after separation is not on the line any more: both beside the level must be in contact.
  const double a_sample = (question.gain * retract.probe.slope).norm() * touch.probe.period();
  const double least = std::max(kLeastThreshold * sigma, a_sample);
  if (level < least || level > kHighestThreshold * deepest) {
    return Refusal{"bad-threshold", touch.plan.name + ": threshold_mm is " + text(level) + " mm; between " +
                                        text(least) + " mm (" +
                                        (least > a_sample ? "noise" : "the travel of one sample") + ") and " +
                                        text(kHighestThreshold * deepest) + " mm (ramp) it determines a point"};
  }
  std::size_t k = size.values.size() - 1;
  while (k > 0 && size.values[k] < level) --k;
  if (k + 1 == size.values.size()) {
    return Refusal{"truncated", touch.plan.name +
                                    ": the probe's record ends before the deflection falls through "
                                    "threshold_mm; measure it again"};
  }
  const double period = size.times[k + 1] - size.times[k];
  const double fall = size.values[k] - size.values[k + 1];
  const double share = (size.values[k] - level) / fall;
  const double variance = sigma * sigma * (share * share + (1.0 - share) * (1.0 - share)) * std::pow(period / fall, 2);
  return Crossing{size.times[k] + share * period, variance};
}

struct Reduced {
  Touch touch;  // relative to the article
  Retract retract;
  Vector3d article_velocity;
  SampleNoise article_noise{};
  ArticleShare article{};
};

// noise: of one sample of each stream, the article's pooled over all touches.
void addNoise(SurfacePoint& point, const Reduced& reduced, const TouchNoise& noise, const SampleNoise& article) {
  const Line& machine = reduced.retract.machine;
  const auto n = static_cast<double>(machine.n);
  const ArticleShare& share = reduced.article;
  // The residuals hold what both streams scatter by.
  const double along = std::max(noise.machine.along - article.along * share.scatter, 0.0);
  const double across = std::max(noise.machine.across - article.across * share.scatter, 0.0);
  point.of_mean += along * noise.machine.of_mean / n + article.along * share.covariance(0, 0);
  point.of_slope = along * noise.machine.of_slope / machine.sxx + article.along * share.covariance(1, 1);
  point.of_both = article.along * share.covariance(0, 1);
  point.across = across * noise.machine.of_mean / n + article.across * share.covariance(0, 0);
  const Vector3d squares = machine.slope.normalized().cwiseAbs2();
  point.of_mean += squares.dot(noise.rounded.mean);
  point.of_slope += squares.dot(noise.rounded.slope);
  point.of_both += squares.dot(noise.rounded.both);
  point.across += 0.5 * (Vector3d::Ones() - squares).dot(noise.rounded.mean);
}

SurfacePoint pointOf(const Reduced& reduced, const TouchNoise& noise, const SampleNoise& article,
                     const std::optional<Crossing>& crossing) {
  const Line& machine = reduced.retract.machine;
  const Line& probe = reduced.retract.probe;
  const double speed = machine.slope.norm();
  const double time = crossing ? crossing->time : separationTime(probe);
  const double of_time = crossing ? crossing->variance
                                  : noise.probe.along / probe.slope.squaredNorm() *
                                        (noise.probe.of_mean / static_cast<double>(probe.n) +
                                         noise.probe.of_slope * std::pow(time - probe.t_mean, 2) / probe.sxx);
  SurfacePoint point;
  point.name = reduced.retract.plan.name;
  point.normal = reduced.retract.plan.normal;
  point.machine = machine.at(time);
  point.apex = reduced.retract.machine_apex;
  point.article_velocity = reduced.article_velocity;
  point.probe_velocity = machine.slope + reduced.article_velocity;
  point.depth_mm = speed * reduced.retract.probe_apex.norm() / probe.slope.norm();
  point.lever_s = time - machine.t_mean;
  point.of_mean = of_time * speed * speed;
  addNoise(point, reduced, noise, article);
  return point;
}

Outcome<Reduced, Refusal> reduce(const Touch& touch, const Touch* article, const StampJitter& jitter) {
  Reduced reduced{.touch = touch, .retract = {}, .article_velocity = Vector3d::Zero()};
  if (article) reduced.touch.machine = relativeTo(article->machine, touch.machine);
  if (reduced.touch.machine.times.size() < 5) {
    return Refusal{
        "gap",
        touch.plan.name + ": the records of machine and article do not overlap in time; record both simultaneously"};
  }
  TRY(auto retract, fitRetract(reduced.touch, jitter));
  if (article) {
    reduced.article_velocity = velocityOf(article->machine, retract.machine);
    reduced.article_noise = articleNoise(article->machine, retract.machine.slope.normalized());
    reduced.article = articleShare(article->machine, reduced.touch.machine, retract.machine);
  }
  reduced.retract = std::move(retract);
  return reduced;
}

// The article's stream of every touch, in the place of the machine's.
Outcome<std::vector<Touch>, Refusal> readArticles(const Dataset& dataset) {
  TRY(checkedTable(dataset, "article", kMachineColumns));
  Dataset turned = dataset;
  std::erase_if(turned.tables, [](const Table& table) { return table.name == "machine"; });
  for (auto& table : turned.tables) {
    if (table.name == "article") table.name = "machine";
  }
  auto read = readTouches(turned);
  if (read) return read;
  return Refusal{read.error().name, "of the article, in the place of the machine: " + read.error().reason};
}

std::optional<Refusal> addPoints(SurfacePoints& result, const std::vector<Reduced>& kept,
                                 const PointQuestion& question) {
  std::vector<Retract> retracts;
  SampleNoise article;
  for (const auto& reduced : kept) {
    retracts.push_back(reduced.retract);
    article.along += reduced.article_noise.along / static_cast<double>(kept.size());
    article.across += reduced.article_noise.across / static_cast<double>(kept.size());
  }
  if (auto refusal = tooFewResiduals(retracts)) return refusal;
  // Interpolation correlates neighbours of what is relative to an article: its share accounts for that.
  const bool relative = article.along > 0.0 || article.across > 0.0;
  const PooledNoise noise = poolNoise(retracts, relative ? Neighbours::interpolated : Neighbours::recorded);
  result.warnings.insert(result.warnings.end(), noise.warnings.begin(), noise.warnings.end());
  result.dof = noise.dof;
  result.least_dof = noise.least_dof;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    std::optional<Crossing> crossing;
    if (question.threshold_mm) {
      TRY(const auto found, crossingOf(kept[i].touch, kept[i].retract, noise.of_touch[i].probe, question));
      crossing = found;
    }
    result.points.push_back(pointOf(kept[i], noise.of_touch[i], article, crossing));
  }
  return std::nullopt;
}

}  // namespace

Outcome<SurfacePoints, Refusal> surfacePoints(const Dataset& dataset, const PointQuestion& question) {
  TRY(const auto recorded, readTouches(dataset));
  const std::vector<Touch> touches = withoutRinging(recorded);
  std::vector<Touch> articles;
  if (dataset.table("article")) {
    TRY(auto read, readArticles(dataset));
    articles = std::move(read);
  }
  const StampJitter jitter = stampJitter(touches);
  SurfacePoints result;
  std::vector<Reduced> kept;
  std::vector<Refusal> refusals;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Touch& touch = touches[i];
    auto reduced = reduce(touch, articles.empty() ? nullptr : &articles[i], jitter);
    if (reduced) {
      kept.push_back(std::move(reduced).value());
      continue;
    }
    if (reduced.error().name == "truncated") return reduced.error();
    result.dropped.push_back({touch.plan.name, reduced.error().name});
    result.warnings.push_back("dropped: " + reduced.error().reason);
    refusals.push_back(reduced.error());
  }
  if (2 * refusals.size() > touches.size() || (!refusals.empty() && kept.size() <= question.unknowns)) {
    return refusals.front();
  }
  if (auto refusal = addPoints(result, kept, question)) return *refusal;
  return result;
}

}  // namespace probebox::metrology
