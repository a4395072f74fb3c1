#include "drivers/io/summed_source.hpp"

#include <cmath>
#include <utility>
#include <variant>

namespace probebox::io {

void SummedCounts::pushPrimary(const Count& count) {
  primary_.push(count);
}

void SummedCounts::pushSecondary(const Count& count) {
  secondary_.push(count);
}

std::optional<Count> SummedCounts::next() {
  while (!primary_.empty() && !secondary_.empty()) {
    Count sum = primary_.front();
    if (secondary_.back().at < sum.at) return std::nullopt;
    // The pair about that stamp.
    while (secondary_.end - secondary_.begin > 1 && secondary_.counts[(secondary_.begin + 1) % kKept].at <= sum.at)
      ++secondary_.begin;
    ++primary_.begin;
    const Count& before = secondary_.front();
    if (before.at > sum.at) continue;
    double counts = 0;
    if (before.at < sum.at) {
      const Count& after = secondary_.counts[(secondary_.begin + 1) % kKept];
      if (after.sequence != before.sequence + 1) continue;
      const double share =
          static_cast<double>((sum.at - before.at).count()) / static_cast<double>((after.at - before.at).count());
      counts = share * static_cast<double>(after.counts - before.counts);
    }
    counts += static_cast<double>(before.counts);
    sum.counts += std::llround(counts_per_count_ * counts);
    return sum;
  }
  return std::nullopt;
}

void SummedCounts::restart() {
  primary_.begin = primary_.end;
  secondary_.begin = secondary_.end;
}

SummedSource::SummedSource(std::unique_ptr<EventSource> primary, std::unique_ptr<EventSource> secondary,
                           double counts_per_count)
    : primary_{std::move(primary)},
      secondary_{std::move(secondary)},
      name_{std::string{primary_->name()} + " + " + std::string{secondary_->name()}},
      sums_{counts_per_count} {}

std::string_view SummedSource::problem() const {
  return primary_->problem().empty() ? secondary_->problem() : primary_->problem();
}

std::size_t SummedSource::read(std::span<Event> into, MonoTime now) {
  std::size_t count = 0;
  bool is_collected = false;
  while (count < into.size()) {
    if (others_taken_ < others_size_) {
      into[count++] = others_[others_taken_++];
    } else if (const auto sum = sums_.next()) {
      into[count++] = *sum;
    } else if (!std::exchange(is_collected, true)) {
      collect(now);
    } else {
      break;
    }
  }
  return count;
}

// The primary axis first: then the other, polled behind it, is as late already.
void SummedSource::collect(MonoTime now) {
  others_size_ = others_taken_ = 0;
  for (auto* const source : {primary_.get(), secondary_.get()}) {
    const std::size_t got = source->read(batch_, now);
    for (std::size_t i = 0; i < got; ++i) take(batch_[i], source == primary_.get());
  }
}

void SummedSource::take(const Event& event, bool is_primary) {
  if (const auto* count = std::get_if<Count>(&event))
    return is_primary ? sums_.pushPrimary(*count) : sums_.pushSecondary(*count);
  others_[others_size_++] = event;
  if (std::holds_alternative<SourceLost>(event)) sums_.restart();
}

}  // namespace probebox::io
