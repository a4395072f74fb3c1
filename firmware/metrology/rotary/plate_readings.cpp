#include "firmware/metrology/rotary/plate_readings.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

struct Tables {
  const Table* first{};
  const Table* second{};
  const Table* third{};
  bool mounts{};
};

Outcome<Tables, Refusal> tablesOf(const Dataset& dataset) {
  std::vector<std::string_view> ball{"ball", "x_mm", "y_mm", "z_mm"};
  TRY(const auto third, checkedTable(dataset, "third", ball));
  const Table* first = dataset.table("first");
  const bool mounts = first && first->column("mount");
  if (mounts) ball.emplace_back("mount");
  TRY(const auto second, checkedTable(dataset, "second", ball));
  ball.emplace_back("phi_rad");
  TRY(const auto checked, checkedTable(dataset, "first", ball));
  return Tables{checked, second, third, mounts};
}

Vector3d placeOf(const Table& table, std::size_t row) {
  return {(*table.column("x_mm"))[row], (*table.column("y_mm"))[row], (*table.column("z_mm"))[row]};
}

// Reads the tables and puts the plate where the second coordinates have it, mount by mount.
class PlateReader {
 public:
  PlateReader(const Tables& tables, const NominalAxis& axis) : tables_{tables}, axis_{axis} {}

  Outcome<PlateReadings, Refusal> read() {
    if (auto refusal = readThird()) return *refusal;
    if (auto refusal = readSecond()) return *refusal;
    if (auto refusal = place()) return *refusal;
    if (auto refusal = readFirst()) return *refusal;
    return std::move(stack_);
  }

 private:
  std::optional<Refusal> readThird() {
    for (std::size_t row = 0; row < tables_.third->rows(); ++row) {
      const double name = (*tables_.third->column("ball"))[row];
      if (!balls_.try_emplace(name, stack_.certified.size()).second) return twice(name, "third");
      stack_.certified.push_back(placeOf(*tables_.third, row));
    }
    return std::nullopt;
  }

  std::optional<Refusal> readSecond() {
    for (std::size_t row = 0; row < tables_.second->rows(); ++row) {
      TRY(const auto ball, ballOf(*tables_.second, row));
      const double name = mountName(*tables_.second, row);
      const auto mount = mounts_.try_emplace(name, mounts_.size()).first->second;
      for (const auto& other : stack_.readings) {
        if (other.mount == mount && other.ball == ball) return twice((*tables_.second->column("ball"))[row], "second");
      }
      stack_.readings.push_back({mount, ball, placeOf(*tables_.second, row) - axis_.point, {}, {}});
    }
    stack_.second_count = stack_.readings.size();
    return std::nullopt;
  }

  std::optional<Refusal> place() {
    for (const auto& [name, mount] : mounts_) {
      std::vector<Vector3d> from;
      std::vector<Vector3d> to;
      for (const auto& reading : stack_.readings) {
        if (reading.mount != mount) continue;
        from.push_back(stack_.certified[reading.ball]);
        to.push_back(reading.at);
      }
      Eigen::MatrixX3d from_rows{static_cast<Index>(from.size()), 3};
      Eigen::MatrixX3d to_rows{static_cast<Index>(to.size()), 3};
      for (std::size_t k = 0; k < from.size(); ++k) {
        from_rows.row(static_cast<Index>(k)) = from[k].transpose();
        to_rows.row(static_cast<Index>(k)) = to[k].transpose();
      }
      const auto motion = registerRigid(from_rows, to_rows);
      if (!motion) {
        return Refusal{motion.error().name, "table 'second', mount " + text(name) + ": " + motion.error().reason};
      }
      stack_.mounts.resize(mounts_.size());
      stack_.mounts[mount] = motion.value();
    }
    return std::nullopt;
  }

  std::optional<Refusal> readFirst() {
    const Table& first = *tables_.first;
    stack_.angles = distinctAngles(*first.column("phi_rad"));
    for (std::size_t row = 0; row < first.rows(); ++row) {
      TRY(const auto ball, ballOf(first, row));
      const auto mount = mounts_.find(mountName(first, row));
      if (mount == mounts_.end()) {
        return Refusal{"missing-ball", "table 'first', row " + std::to_string(row + 1) + ": mount " +
                                           text(mountName(first, row)) +
                                           " is not in table 'second': read the plate there with the axis at zero"};
      }
      const double phi = (*first.column("phi_rad"))[row];
      const auto angle = std::ranges::lower_bound(stack_.angles, phi - kSameTableAngle_rad) - stack_.angles.begin();
      stack_.readings.push_back(
          {mount->second, ball, placeOf(first, row) - axis_.point, static_cast<std::size_t>(angle), {}});
    }
    return std::nullopt;
  }

  double mountName(const Table& table, std::size_t row) const {
    return tables_.mounts ? (*table.column("mount"))[row] : 1.0;
  }
  static Refusal twice(double ball, const char* table) {
    return {"duplicated-ball",
            "table '" + std::string{table} + "' has ball " + text(ball) + " twice: give every ball once a mount"};
  }
  Outcome<std::size_t, Refusal> ballOf(const Table& table, std::size_t row) const {
    const double name = (*table.column("ball"))[row];
    const auto ball = balls_.find(name);
    if (ball != balls_.end()) return ball->second;
    return Refusal{"missing-ball", "ball " + text(name) + " of table '" + table.name +
                                       "' is not in table 'third': give its certified coordinates, or omit it"};
  }

  Tables tables_;
  NominalAxis axis_;
  PlateReadings stack_;
  std::map<double, std::size_t> balls_;
  std::map<double, std::size_t> mounts_;
};

}  // namespace

Outcome<PlateReadings, Refusal> readPlates(const Dataset& dataset, const NominalAxis& axis) {
  TRY(const auto tables, tablesOf(dataset));
  return PlateReader{tables, axis}.read();
}

}  // namespace probebox::metrology
