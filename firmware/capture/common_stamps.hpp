#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::capture {

// Brings counts of axes that are read one by one, each with stamps of its own, to common stamps: those of the slowest
// axis, so that no row repeats another. The others are interpolated linearly between their neighbours; over a read's
// interval that errs by at most Ts^2/8 |x''|: 0.1 nm at 1 kHz and 1 m/s^2. Never allocates.
class CommonStamps {
 public:
  struct Row {
    MonoTime at{};
    std::array<std::int64_t, kLinearAxes> counts{};
    // Extensions of the screws, as given to push(); nothing where unknown.
    std::array<std::optional<std::int32_t>, kLinearAxes> screw_nm{};
  };

  // interval: between counts of each axis; zero for an axis without an encoder, whose counts are 0.
  explicit CommonStamps(const std::array<Nanoseconds, kLinearAxes>& interval);

  void push(const Count& count, std::optional<std::int32_t> screw_nm);
  // The next row that all axes have reached.
  std::optional<Row> next();

  // Rows without counts of another axis around their stamp.
  std::uint64_t incomplete() const { return incomplete_; }

 private:
  struct Point {
    MonoTime at{};
    std::int64_t counts{};
    std::optional<std::int32_t> screw_nm{};
  };
  // The latest counts of one axis: 50 ms at 10 kHz.
  struct Track {
    static constexpr std::size_t kKept = 512;
    std::array<Point, kKept> points{};
    std::size_t end{};

    std::size_t first() const { return end > kKept ? end - kKept : 0; }
    const Point& at(std::size_t i) const { return points[i % kKept]; }
  };
  enum class Found { waiting, missing, found };

  Found find(std::size_t axis, MonoTime at, Row& row) const;

  std::array<Nanoseconds, kLinearAxes> interval_;
  std::size_t slowest_{};
  std::array<Track, kLinearAxes> tracks_{};
  std::size_t next_{};  // point of the slowest axis
  std::uint64_t incomplete_{};
};

}  // namespace probebox::capture
