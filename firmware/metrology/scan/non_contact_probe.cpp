#include "firmware/metrology/scan/non_contact_probe.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

Outcome<bool, Refusal> readsDistances(const Dataset& dataset) {
  constexpr std::array<std::string_view, 2> kKinds{"deflection", "distance"};
  TRY(const auto kind, configWord(dataset, "probe_kind", kKinds));
  return kind.value_or("deflection") == "distance";
}

namespace {

struct Span {
  double first{};
  double last{};
  double largest{};
};

double undeflectedOf(const Span& span, Undeflected undeflected) {
  return undeflected == Undeflected::ends ? std::min(span.first, span.last) : span.largest + 1.0;
}

}  // namespace

Outcome<Dataset, Refusal> withDeflections(const Dataset& dataset, std::string_view group, Undeflected undeflected) {
  TRY(const auto read, checkedTable(dataset, "probe", {group, column::kTime, column::kDistance}));
  const auto& ids = *read->column(group);
  const auto& times = *read->column(column::kTime);
  const auto& distances = *read->column(column::kDistance);
  std::map<double, Span> spans;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    const double at = distances[row];
    Span& span = spans.try_emplace(ids[row], Span{at, at, at}).first->second;
    span.last = at;
    span.largest = std::max(span.largest, at);
  }
  const auto& channels = column::kChannels;
  Table probe = Table::withColumns("probe", {group, column::kTime, channels[0], channels[1], channels[2]});
  for (std::size_t row = 0; row < ids.size(); ++row) {
    probe.append({ids[row], times[row], undeflectedOf(spans[ids[row]], undeflected) - distances[row], 0.0, 0.0});
  }
  Dataset converted = dataset;
  for (auto& table : converted.tables) {
    if (table.name == "probe") table = std::move(probe);
  }
  return converted;
}

}  // namespace probebox::metrology
