#include "drivers/io/summed_source.hpp"

#include <utility>
#include <variant>

namespace probebox::io {

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
