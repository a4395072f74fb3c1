#include "drivers/gpio/quadrature.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace probebox::gpio {
namespace {

// A rate that swings about the limit is refused once.
constexpr double kAcceptedAgain = 0.8;
// A capture thread that stood still for longer starts its counts anew; the latch has lost those samples.
constexpr Nanoseconds kLongestSilence = std::chrono::seconds{1};

WatchedLine watched(Phase phase, board::ActiveLevel active) {
  return {0, LineRole::trigger, static_cast<std::uint8_t>(phase), active, Edges::both};
}

}  // namespace

QuadratureDecoder::Heard QuadratureDecoder::push(const Edge& edge) {
  const std::size_t phase = edge.line % 2U, other = 1 - phase;
  const bool high = edge.level == Level::active;
  const std::uint32_t step = edge.line_sequence - sequence_[phase];
  const bool was_known = std::exchange(known_[phase], true);
  const bool before = std::exchange(high_[phase], high);
  sequence_[phase] = edge.line_sequence;
  if (step == 0) {
    // Told again at another level: what lies in between was not seen.
    if (!was_known || before == high) return Heard::level;
    ++illegal_;
    return Heard::broken;
  }
  missed_ += step - 1;
  if (step != 1 || (was_known && before == high) || !known_[other]) {
    ++illegal_;
    return Heard::broken;
  }
  // Up while A leads B: A changes away from B, B changes to be as A.
  const bool is_up = (high != high_[other]) == (phase == 0);
  count_ += is_up ? 1 : -1;
  return Heard::counted;
}

ChipLines quadratureLines(const board::GpioLine& a, const board::GpioLine& b) {
  return {a.chip, {{a.name, a.line, watched(Phase::a, a.active)}, {b.name, b.line, watched(Phase::b, b.active)}}};
}

QuadratureSource::QuadratureSource(std::unique_ptr<io::EventSource> edges, const QuadratureConfig& config)
    : edges_{std::move(edges)},
      config_{config},
      axis_{config.axis},
      name_{std::string{"encoder "} + axis_.letter() + " on " + std::string{edges_->name()}},
      too_fast_{"its edges come faster than " + std::to_string(std::lround(config.maximum_edge_rate_hz)) +
                " a second ('maximum_edge_rate_hz'), and are not counted: move the axis more slowly and home it again, "
                "or count with a counter"} {}

std::string_view QuadratureSource::problem() const {
  return refused_ ? std::string_view{too_fast_} : edges_->problem();
}

std::size_t QuadratureSource::read(std::span<Event> into, MonoTime now) {
  std::size_t count = 0;
  while (count < into.size()) {
    if (std::exchange(loss_unreported_, false)) {
      into[count++] = loss_;
      continue;
    }
    if (batch_taken_ == batch_size_ && !refill(now)) break;
    const Event& event = batch_[batch_taken_];
    // Between two edges the count stays as it is.
    count += giveUntil(stampOf(event), into.subspan(count));
    if (count == into.size()) return count;
    take(event);
    ++batch_taken_;
  }
  // An axis that has come to rest makes no edges that would tell so.
  if (refused_) refused_ = isFasterThan(kAcceptedAgain * config_.maximum_edge_rate_hz, now);
  return count + giveUntil(now - kPatience, into.subspan(count));
}

bool QuadratureSource::refill(MonoTime now) {
  batch_taken_ = 0;
  batch_size_ = edges_->read(batch_, now);
  return batch_size_ > 0;
}

std::size_t QuadratureSource::giveUntil(MonoTime end, std::span<Event> into) {
  if (!decoder_.knowsLevels() || refused_) {
    has_next_ = false;
    return 0;
  }
  if (!has_next_ || end - next_at_ > kLongestSilence) {
    // On a grid of whole intervals, as the other axes.
    next_at_ = monoTime((toNs(end) / config_.interval.count() + 1) * config_.interval.count());
    has_next_ = true;
  }
  std::size_t count = 0;
  for (; count < into.size() && next_at_ < end; next_at_ += config_.interval)
    into[count++] = axis_.count(sequence_++, decoder_.count(), next_at_);
  return count;
}

void QuadratureSource::take(const Event& event) {
  if (const auto* const edge = std::get_if<Edge>(&event)) return take(*edge);
  const auto* const lost = std::get_if<SourceLost>(&event);
  if (lost == nullptr) return;
  decoder_.restart();
  lose(lost->reason, lost->lost, lost->at);
}

void QuadratureSource::take(const Edge& edge) {
  const auto missed = decoder_.missed();
  const auto heard = decoder_.push(edge);
  if (heard == QuadratureDecoder::Heard::level) return;
  judgeRate(edge.at);
  if (has_next_ && edge.at < next_at_ - config_.interval) ++late_edges_;
  if (heard == QuadratureDecoder::Heard::broken && !refused_)
    lose(LossReason::overrun, decoder_.missed() - missed, edge.at);
}

void QuadratureSource::judgeRate(MonoTime at) {
  latest_[edges_seen_++ % kRateEdges] = at;
  const bool was_refused = refused_;
  refused_ = isFasterThan(config_.maximum_edge_rate_hz * (was_refused ? kAcceptedAgain : 1), at);
  if (refused_ && !was_refused) lose(LossReason::overrun, 0, at);
}

// By the time since the oldest of the latest edges.
bool QuadratureSource::isFasterThan(double rate_hz, MonoTime now) const {
  if (edges_seen_ < kRateEdges) return false;
  const MonoTime oldest = latest_[edges_seen_ % kRateEdges];
  return static_cast<double>(kRateEdges - 1) > rate_hz * toSeconds(now - oldest);
}

// One at a time: what is lost before it was told is lost once.
void QuadratureSource::lose(LossReason reason, std::uint64_t events, MonoTime at) {
  const std::uint32_t before = loss_unreported_ ? loss_.lost : 0;
  loss_ = std::get<SourceLost>(axis_.lost(reason, before + static_cast<std::uint32_t>(events), at));
  loss_unreported_ = true;
}

}  // namespace probebox::gpio
