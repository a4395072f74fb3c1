#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Samples that a scan needs of machine and probe.
inline constexpr std::size_t kLeastOfContour = 50;

// Rows of one scan in one table as points on their stamps, without spikes.
struct ScanPoints {
  std::vector<double> times;
  std::vector<Eigen::Vector3d> values;
  std::vector<std::string> spikes;  // names of the samples that were removed
};

// columns: scan, t_s and three values. Refuses: too-few-samples (fifty), time-not-rising, gap (a span of ten times what
// the samples cover).
Outcome<ScanPoints, Refusal> scanPoints(const Table& table, const ColumnNames& columns, double id,
                                        const std::string& scan);

// Refuses speed-differs: both streams by a clock of another rate show the same motion, and its speed alone tells.
std::optional<Refusal> speedDiffers(const ScanPoints& machine, const std::string& scan, double nominal_mm_s,
                                    bool in_circles);

}  // namespace probebox::metrology
