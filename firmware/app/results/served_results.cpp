#include "firmware/app/results/served_results.hpp"

#include "firmware/app/results/result_values.hpp"

namespace probebox::app {

published::ServedResult servedOf(const store::Record& record, bool rests_on_retired) {
  constexpr std::size_t kMostValues = 12;
  published::ServedResult served{.subject = record.binding.subject,
                                 .result_id = record.id,
                                 .probe_tool = 0,
                                 .rests_on_retired = rests_on_retired,
                                 .values = {}};
  const auto* result = record.result();
  if (result == nullptr) return served;
  served.probe_tool = probeToolOf(*result);
  for (const auto* list : {&result->estimates, &result->also}) {
    for (const auto& estimate : *list) {
      if (estimate.values.size() > kMostValues) continue;
      const auto sd = uncertaintiesOf(estimate);
      served.values.push_back({estimate.key, estimate.values, {sd.begin(), sd.end()}});
    }
  }
  return served;
}

}  // namespace probebox::app
