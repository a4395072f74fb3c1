#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/metrology/live/angle_table.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

static_assert(kMostErrorRows == metrology::kMostAngles);

// Assembles a table by angle that arrives one row per event. kWidth: number of errors per row.
template <int kWidth>
class IncomingTable {
 public:
  void expect(std::uint64_t result_id, std::size_t rows) {
    result_id_ = result_id;
    expected_ = rows;
    count_ = 0;
  }
  // Returns true with the last missing row. Rows of other results are ignored.
  bool add(const ErrorsAtAngle& row) {
    if (row.result_id != result_id_ || count_ >= std::min(expected_, kMostErrorRows)) return false;
    angles_[count_] = row.angle_rad;
    for (int i = 0; i < kWidth; ++i) rows_[count_][i] = row.errors[static_cast<std::size_t>(i)];
    return ++count_ == expected_;
  }
  // Builds the table. Refusals: see AngleTable::make.
  Outcome<metrology::AngleTable<kWidth>, metrology::Refusal> table(metrology::Between between) const {
    return metrology::AngleTable<kWidth>::make(std::span{angles_.data(), count_}, std::span{rows_.data(), count_},
                                               between);
  }

 private:
  using Row = typename metrology::AngleTable<kWidth>::Row;

  std::uint64_t result_id_{};
  std::size_t expected_{};
  std::size_t count_{};
  std::array<double, kMostErrorRows> angles_{};
  std::array<Row, kMostErrorRows> rows_{};
};

}  // namespace probebox::corrections
