#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/event_source.hpp"
#include "protocol/events/event.hpp"

namespace probebox::io {

// Adds the counts of a secondary axis (U, V or W, parallel to X, Y or Z by ISO 841) to those of its primary axis, at
// the stamps of the latter. Between two stamps of the secondary axis its counts are interpolated linearly, so a count
// waits until the secondary axis has one that is as late. Pure; never allocates.
class SummedCounts {
 public:
  static constexpr std::size_t kKept = 512;  // of each axis: 50 ms at 10 kHz

  // counts_per_count: of the primary axis, for one of the secondary axis; negative where the encoders count in opposite
  // senses.
  explicit SummedCounts(double counts_per_count) : counts_per_count_{counts_per_count} {}

  // Stamps of an axis never go back.
  void pushPrimary(const Count& count);
  void pushSecondary(const Count& count);
  // The next sum, under the sequence number of the primary axis. Counts without one of the secondary axis around their
  // stamp, or in a gap of its own sequence, are left out, and the gap in theirs shows it.
  std::optional<Count> next();
  // Either encoder was lost: what waits has no sum, and what comes begins anew.
  void restart();

 private:
  struct Track {
    std::array<Count, kKept> counts{};
    std::size_t begin{}, end{};

    bool empty() const { return begin == end; }
    const Count& front() const { return counts[begin % kKept]; }
    const Count& back() const { return counts[(end - 1) % kKept]; }
    void push(const Count& count) {
      if (end - begin == kKept) ++begin;
      counts[end++ % kKept] = count;
    }
  };

  double counts_per_count_;
  Track primary_, secondary_;
};

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
