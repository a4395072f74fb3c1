#pragma once
#include <array>
#include <memory>
#include <string>

#include "drivers/io/event_source.hpp"
#include "drivers/io/summed_counts.hpp"

namespace probebox::io {

// Delivers the counts of a primary axis with those of its secondary axis added, from the sources of both, which say the
// primary axis in their events. When either is lost, the sum is.
class SummedSource final : public EventSource {
 public:
  SummedSource(std::unique_ptr<EventSource> primary, std::unique_ptr<EventSource> secondary, double counts_per_count);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return primary_->descriptor(); }
  std::string_view name() const override { return name_; }
  std::string_view problem() const override;
  std::uint64_t unusable() const override { return primary_->unusable() + secondary_->unusable(); }

 private:
  static constexpr std::size_t kBatch = 64;

  void collect(MonoTime now);
  void take(const Event& event, bool is_primary);

  std::unique_ptr<EventSource> primary_, secondary_;
  std::string name_;
  SummedCounts sums_;
  std::array<Event, kBatch> batch_{};
  std::array<Event, 2 * kBatch> others_{};  // what are no counts, before the sums
  std::size_t others_size_{}, others_taken_{};
};

}  // namespace probebox::io
