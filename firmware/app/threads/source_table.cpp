#include "firmware/app/threads/source_table.hpp"

#include "firmware/app/log/log.hpp"

namespace probebox::app {

void SourceTable::add(std::string_view name) {
  const std::lock_guard lock{mutex_};
  rows_.push_back({.name = std::string{name}, .problem = {}, .faults = {}});
}

void SourceTable::tell(std::size_t row, std::string_view problem) {
  const std::lock_guard lock{mutex_};
  auto& [name, known, faults, unusable] = rows_.at(row);
  if (known == problem) return;
  known = problem;
  if (problem.empty()) {
    logInfo(name + " is there.");
  } else {
    logWarning(name + " gives nothing: " + known + ". The box continues without it and keeps trying.");
  }
}

void SourceTable::tellFaults(std::size_t row, std::string_view faults) {
  const std::lock_guard lock{mutex_};
  auto& known = rows_.at(row);
  if (known.faults == faults) return;
  known.faults = faults;
  if (!faults.empty()) logWarning(known.name + " says: " + known.faults + ".");
}

void SourceTable::tellUnusable(std::size_t row, std::uint64_t count) {
  const std::lock_guard lock{mutex_};
  rows_.at(row).unusable = count;
}

std::vector<SourceTable::Row> SourceTable::rows() const {
  const std::lock_guard lock{mutex_};
  return rows_;
}

}  // namespace probebox::app
