#include "tools/probebox/text/report.hpp"

namespace probebox::command {

std::string cutLine() {
  return printed("%-18s %s", "a cut is on",
                 "an inhibit line of the box is active, or gives no level: no result comes into force");
}

Json inhibitsOf(const std::vector<messages::InhibitHolder>& holders) {
  Json all = Json::array();
  for (const auto& holder : holders)
    all.push_back({{"door", holder.door}, {"by", holder.by}, {"since_utc", holder.since_utc}});
  return all;
}

std::string line(const messages::InhibitHolder& holder) {
  return (holder.by.empty() ? holder.door : holder.by) + ", since " + holder.since_utc;
}

}  // namespace probebox::command
