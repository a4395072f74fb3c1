#include "firmware/app/threads/source_table.hpp"

#include "firmware/app/log/log.hpp"

namespace probebox::app {

void SourceTable::add(std::string_view name, std::span<const io::SourceFault> fault_names) {
  const std::lock_guard lock{mutex_};
  rows_.push_back({.name = std::string{name}, .problem = {}, .faults = {}});
  faults_.push_back({fault_names});
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

void SourceTable::tellFaults(std::size_t row, std::uint32_t faults) {
  const std::lock_guard lock{mutex_};
  faults_.at(row).now = faults;
}

std::string SourceTable::Faults::inWords() const {
  std::string all;
  for (std::size_t bit = 0; bit < names.size(); ++bit)
    if ((now >> bit & 1U) != 0)
      all += (all.empty() ? "" : "; ") + std::string{names[bit].name} + ": " + std::string{names[bit].meaning};
  return all;
}

void SourceTable::logFaults() {
  std::vector<Faults> all;
  {
    const std::lock_guard lock{mutex_};
    all = faults_;
    for (auto& faults : faults_) faults.logged = faults.now;
  }
  for (std::size_t row = 0; row < all.size(); ++row)
    if ((all[row].now & ~all[row].logged) != 0) logWarning(rows().at(row).name + " says: " + all[row].inWords() + ".");
}

void SourceTable::tellUnusable(std::size_t row, std::uint64_t count) {
  const std::lock_guard lock{mutex_};
  rows_.at(row).unusable = count;
}

std::vector<SourceTable::Row> SourceTable::rows() const {
  std::vector<Row> rows;
  std::vector<Faults> faults;
  {
    const std::lock_guard lock{mutex_};
    rows = rows_;
    faults = faults_;
  }
  for (std::size_t row = 0; row < rows.size(); ++row) rows[row].faults = faults.at(row).inWords();
  return rows;
}

}  // namespace probebox::app
